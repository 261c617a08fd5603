"""What mutants.py of vest_haptics spoils in this package: file, text, what it becomes, test program, test that must go red."""
F, P, D, E, T = ("src/driver/footswitches.cpp", "src/protocol/decoder.cpp", "src/driver/driver.cpp", "src/events/input_device.cpp",
                 "src/driver/time_map.cpp")
USER = {}
# Each branch of these has a mutant, or a reason.
GUARDED = [F, T]
MUTANTS = [
    # Pedals.
    (F, "  if (down) {\n    pressed_ =", "  if (true) {\n    pressed_ =", "driver", "Footswitches.OlderThan*"),
    (F, "    if (may_be_tap && now", "    if (now", "driver", "Footswitches.OlderThan*:Footswitches.Unplugged*"),
    (F, "may_be_tap && now - pressed_at_[pedal] < options_.quick_tap", "may_be_tap", "driver", "Footswitches.AQuickTap*"),
    (F, "device - last_device_ > options_.debounce;", "false;", "driver", "Footswitches.AHole*"),
    (F, "    if (down == was) {", "    if (false) {", "driver", "Footswitches.*"),
    (F, "    } else if (!differs_[i] || hole) {", "    } else if (hole) {", "driver", "Footswitches.Chatter*:Footswitches.AllSixtyFour*"),
    (F, "    } else if (!differs_[i] || hole) {", "    } else if (!differs_[i]) {", "driver", "Footswitches.AHole*"),
    (F, "    } else if (device - differs_since_[i] >= options_.debounce) {", "    } else {", "driver", "Footswitches.Chatter*"),
    (F, "  if (has_reading_ && now - last_now_ > options_.timeout) releaseAll();\n", "", "driver", "Footswitches.OlderThan*"),
    (F, "    if (pressed_ & (1u << i)) change(", "    change(", "driver", "Footswitches.OlderThan*"),
    (F, "(pressed_ & (1u << i)) && now - pressed_at_[i] > options_.stuck", "pressed_ & (1u << i)", "driver", "Footswitches.APedalThatStays*"),
    (F, "(pressed_ & (1u << i)) && now - pressed_at_[i] > options_.stuck", "now - pressed_at_[i] > options_.stuck", "driver", "Footswitches.APedalThatStays*"),
    # Bytes.
    (P, "    if (p[0] != kSync0 || ", "    if (", "protocol", "Protocol.*"),
    (P, "(left > 1 && p[1] != kSync1) || ", "", "protocol", "Protocol.*"),
    (P, " || (left > 3 && p[3] > kMaxPayload)", "", "protocol", "Protocol.*"),
    (P, "crc16(p + 2, crc_at - 2) != get16(p + crc_at) ||\n        ", "", "protocol", "Protocol.*"),
    (P, " ||\n        p[crc_at + 2] != static_cast<std::uint8_t>(p[4] ^ kEndMask)", "", "protocol", "Protocol.*"),
    (P, "    if (left < total) break;\n", "", "protocol", "Protocol.FramesMay*"),
    (P, "  } else if (step == 0) {", "  } else if (false) {", "protocol", "Protocol.ARepeated*"),
    (P, "  } else if (step >= 0x8000) {", "  } else if (false) {", "protocol", "Protocol.ABoxThatStarts*"),
    # Readings of the box.
    (D, "  if (m.instruments != hello_.instruments) {\n    ++", "  if (false) {\n    ++", "driver", "Driver.AMotionFrame*"),
    (D, "  if (!has_hello_ || hello_.version_major != protocol::kVersionMajor) return false;", "  if (!has_hello_) return false;", "driver", "Driver.NothingIsUsed*"),
    (D, "  if (!has_hello_ || hello_.version_major != protocol::kVersionMajor) return false;", "  if (hello_.version_major != protocol::kVersionMajor) return false;", "driver", "Driver.NothingIsUsed*:Driver.AMotionFrame*"),
    (D, "  if (!(m.status & protocol::kPedalsMissing)) foot", "  foot", "driver", "Footswitches.Unplugged*"),
    (D, "box_usable && !(m.invalid & (1u << i)) && m.counts[i] != protocol::kNoReading", "!(m.invalid & (1u << i)) && m.counts[i] != protocol::kNoReading", "driver", "Driver.ABoxWithoutReference*"),
    (D, "box_usable && !(m.invalid & (1u << i)) && m.counts[i] != protocol::kNoReading", "box_usable && m.counts[i] != protocol::kNoReading", "driver", "*EveryBreak*"),
    (D, " && m.counts[i] != protocol::kNoReading", "", "driver", "Driver.TheCountForNoReading*"),
    (D, "g.has_raw && device_us_ - g.last_raw_us <= hold_us && consistent(g.last_raw, g.last_raw_us);", "true;", "driver", "Driver.ASensorThatNeverSettles*"),
    (D, "  if (g.accepted && device_us_ - g.good_us > hold_us) {", "  if (false) {", "driver", "*EveryBreak*:Driver.AfterAHole*"),
    (D, "(g.accepted ? consistent(g.good, g.good_us) : g.settled >= options_.settle);", "true;", "driver", "*EveryBreak*"),
    (D, "std::clamp(raw, c.min, c.max);", "raw;", "driver", "Driver.PositionsStay*"),
    (D, "  if (now - last_frame_ > options_.stale) return BoxState::kStale;\n", "", "driver", "Driver.WithoutFrames*"),
    (D, "  if (has_time_ && step_us <= 0) {", "  if (false) {", "driver", "Driver.*"),
    (D, "  if (hello.start || ", "  if (", "driver", "Driver.ABoxThatRestarts*"),
    # Pedals and gamepads.
    (E, "    if (read == EventSource::Read::Gone) {", "    if (false) {", "events", "Events.AnUnplugged*"),
    (E, "    if (source_->keyDown(*code)) next_buttons_ |= 1u << keys_.size();\n", "", "events", "Events.AButtonThatIsHeld*"),
    (E, " && now - pressed_at_[i] > kStuck", "", "events", "Events.AButtonThatIsHeld*"),
    # Time.
    (T, "delay_now - steady_minus_device_ > kMaxDelay", "false", "driver", "TimeMap.ADeviceClock*"),
    (T, "std::min(delay_now, steady_minus_device_ + drift)", "delay_now", "driver", "TimeMap.LateArrival*"),
    (T, "    if (wall_step_ > kStep) {", "    if (false) {", "driver", "TimeMap.*"),
    (T, "std::clamp(wall_step_, -slew, slew)", "wall_step_", "driver", "TimeMap.StampsNever*"),
    (T, "    if (!has_device_) {", "    if (false) {", "driver", "TimeMap.*"),
    (T, "  if (!has_wall_) {", "  if (false) {", "driver", "TimeMap.*"),
    (T, "std::max(last_stamp_ + 1, ", "(", "driver", "TimeMap.*"),
]
ARGUED = [
    (T, "std::max<std::int64_t>(0, steady", "a steady clock does not go back; std::clamp would not be defined if it did"),
    (F, "    if (event_count_ < static_cast<int>(events_.size()))", "cannot be full: at most three events a pedal between two calls of take()"),
]
