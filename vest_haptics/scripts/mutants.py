#!/usr/bin/env python3
"""Shows that each guard is needed: spoils one branch at a time, and the named test must go red.

A spoiled source file is compiled into a library of its own that is loaded in front of the real one, so one mutant costs one
file. A table entry whose text is not found exactly once is an error: the table follows the code.
usage: mutants.py --tests DIR --include DIR … [--some N] [--only WORD]
"""
import argparse
import os
import subprocess
import sys
import tempfile

PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
L, F, S, P, C, M, R, X, G = (
    "src/safety/limiter.cpp", "src/safety/freshness.cpp", "src/safety/sensor_check.cpp", "src/safety/passivity.cpp",
    "src/loop/controller.cpp", "src/device/mailbox_device.cpp", "src/loop/registration.cpp", "src/loop/contact_force.cpp",
    "include/vest_haptics/safety/gate.h")
H = "src/device/phantom.cpp"
# file, text, what it becomes, test program, test that must go red
MUTANTS = [
    # The limiter.
    (L, "    if (!isFinite(wanted[i])) {", "    if (false) {", "limiter", "Limiter.NoBitPattern*"),
    (L, "  return (bits & 0x7ff0000000000000ull) != 0x7ff0000000000000ull;", "  return bits != 0x7ff0000000000000ull;", "limiter", "Limiter.NoBitPattern*"),
    (L, "      return zero();\n", "", "limiter", "Limiter.NoBitPattern*"),
    (L, "  if (!isFinite(allowance) || allowance < 0.0 || allowance > 1.0) {", "  if (!isFinite(allowance) || allowance < 0.0) {", "limiter", "Limiter.NoBitPattern*"),
    (L, "  if (!isFinite(allowance) || allowance < 0.0 || allowance > 1.0) {", "  if (!isFinite(allowance) || allowance > 1.0) {", "limiter", "Limiter.NoBitPattern*"),
    (L, "  if (!isFinite(allowance) || allowance < 0.0 || allowance > 1.0) {", "  if (allowance < 0.0 || allowance > 1.0) {", "limiter", "Limiter.NoBitPattern*"),
    (L, "  if (m > most) {", "  if (false) {", "limiter", "Limiter.NoBitPattern*"),
    (L, "  if (length > most) {", "  if (false) {", "limiter", "Limiter.NoBitPattern*"),
    (L, "      target[i] *= allowance;\n", "", "limiter", "Limiter.TheAllowance*:Limiter.ZeroIsZero*"),
    (L, "    if (allowance > 0.0 && shorten(step, size, options_.slew_per_tick[g])) {", "    if (false) {", "limiter", "Limiter.NoBitPattern*"),
    (L, "    if (allowance > 0.0 && shorten(", "    if (shorten(", "limiter", "Limiter.ZeroIsZero*"),
    (L, "  last_.fill(0.0);\n", "", "limiter", "Limiter.ZeroIsZero*:Limiter.NoBitPattern*"),
    (L, "  last_ = out;\n", "", "limiter", "Limiter.*"),
    # Age of the data.
    (F, "  if (!(age < kDecayEnds)) return 0.0;  // also NaN\n", "", "safety", "Freshness.ForceDecays*"),
    (F, "  if (!(age < kDecayEnds)) return 0.0;", "  if (age >= kDecayEnds) return 0.0;", "safety", "Freshness.ForceDecays*"),
    (F, "  if (age <= kDecayBegins) return 1.0;\n", "", "safety", "Freshness.ForceDecays*"),
    (F, "  if (steady_ns > now_ns + static_cast<std::int64_t>(kFutureTolerance * 1e9)) return false;\n", "", "safety", "Freshness.AStamp*"),
    (F, "    if (generation < generation_) return false;\n", "", "safety", "Freshness.AStamp*"),
    (F, "    if (generation == generation_ && step <= step_) return false;\n", "", "safety", "Freshness.AStepThat*:Freshness.AStamp*"),
    (F, "generation == generation_ && step <= step_", "step <= step_", "safety", "Freshness.AStamp*"),
    (F, "    if (steady_ns <= steady_ns_) return false;\n", "", "safety", "Freshness.AStamp*"),
    (F, "  if (!any_) return std::numeric_limits<double>::infinity();\n", "", "safety", "Freshness.AStamp*"),
    # Start-up and after faults: the header is part of the controller.
    (G, "    if (!healthy) {", "    if (false) {", "controller", "Controller.Disabled*:Controller.ASimulation*:Controller.AfterA*"),
    (G, "      close();\n", "", "controller", "Controller.AfterA*:Controller.Disabled*"),
    (G, "    if (small_ < kSmallTicks) {", "    if (false) {", "controller", "Controller.ADeviceThatWakes*"),
    (G, "share <= kSmallShare ? small_ + 1 : 0;", "small_ + 1;", "controller", "Controller.ADeviceThatWakes*"),
    (G, "    ramp_ += dt / kRampSeconds;", "    ramp_ = 1.0;", "controller", "Controller.ADeviceThatWakes*"),
    # Readings.
    (S, "      if (!isFinite(s.joints[i])) return false;\n", "", "safety", "SensorCheck.TheFirst*"),
    (S, "      if (any_ && !(std::abs(s.joints[i] - good_.joints[i]) <= (i == 2 ? reach : turn))) return false;\n", "", "safety", "SensorCheck.Every*"),
    (S, "    if (!isFinite(s.position[i])) return false;\n", "", "safety", "SensorCheck.TheFirst*"),
    (S, "  if (any_ && !((s.position - good_.position).squaredNorm() <= reach * reach)) return false;\n", "", "safety", "SensorCheck.Every*"),
    (S, "    if (!(std::abs(s.orientation.squaredNorm() - 1.0) <= 0.02)) return false;\n", "", "safety", "SensorCheck.Every*"),
    (S, "    if (any_ && turn < 3.0 && !(c >= std::cos(0.5 * turn) * 0.98)) return false;\n", "", "safety", "SensorCheck.AnAttitude*"),
    (S, "    if (any_ && !(std::abs(s.jaw - good_.jaw) <= turn)) return false;\n", "", "safety", "SensorCheck.Every*"),
    (S, "  sample = good_;\n", "", "safety", "SensorCheck.Every*"),
    (S, "  if (bad_since_ < 0) bad_since_ = now_ns;\n", "  bad_since_ = now_ns;\n", "safety", "SensorCheck.Every*"),
    (S, "  const bool held = any_ && ", "  const bool held = ", "safety", "SensorCheck.TheFirst*"),
    # Energy.
    (P, "    if (norm == 0.0) energy_ = 0.0;", "", "safety", "Passivity.TheObserver*"),
    (P, "    if (energy_ > stored) energy_ = stored;\n", "", "safety", "Passivity.Friction*"),
    (P, "    if (energy_ < 0.0 && square > 0.0) {", "    if (false) {", "safety", "Passivity.TheController*"),
    (P, "std::min(-energy_ * dt / square, most_damping_)", "-energy_ * dt / square", "safety", "Passivity.TheController*"),
    (C, "  if (options_.passivity && r.allowance > 0.0) {", "  if (false) {", "controller", "Controller.ThePassivity*"),
    (C, "      coupling_(std::min(capabilities.stiffness,", "      coupling_(std::max(capabilities.stiffness,", "controller", "Controller.TheCoupling*"),
    # States, faults and their order in the tick.
    (C, "  if (in.status == DeviceStatus::Error) raise(Fault::DeviceError);\n", "", "controller", "Controller.AnErrorOf*"),
    (C, "      raise(Fault::Sensor);\n", "", "controller", "Controller.Spoiled*"),
    (C, "      raise(Fault::ContactModel);\n", "", "controller", "Controller.AnExploding*"),
    (C, "  if (r.limits & kLimitNotFinite) raise(Fault::NotFinite);\n", "", "controller", "Controller.AServoForceThatIsNoNumber*"),
    (C, "  if (dt < 0.0) raise(Fault::Clock);\n", "", "controller", "Controller.ASteadyClock*"),
    (C, "      if (state == OperatingState::Fault) return false;\n", "", "controller", "Controller.AnErrorOf*"),
    (C, "      if (state != OperatingState::Enabled) return false;\n", "", "controller", "Controller.AnErrorOf*"),
    (C, "      if (state != OperatingState::Paused) return false;\n", "", "controller", "Controller.AnErrorOf*"),
    (C, "  if (fresh == 0.0) contact_.reset();\n", "", "controller", "Controller.AfterOldData*"),
    (C, "    for (double& x : all) x *= fresh;\n", "", "controller", "Controller.ASimulation*"),
    (C, "    for (double& x : wanted) x /= beyond;\n", "", "controller", "Controller.ASimulationThatDiesBeyond*"),
    (C, "enabled && r.valid && !pause && registered &&", "r.valid && !pause && registered &&", "controller", "Controller.Disabled*"),
    (C, "enabled && r.valid && !pause && registered &&", "enabled && r.valid && registered &&", "controller", "Controller.ALoopThatStood*"),
    (C, "enabled && r.valid && !pause && registered &&", "enabled && r.valid && !pause &&", "controller", "Controller.WhenTheInstrument*"),
    (C, "    r.loads = limiter_.zero();\n", "", "controller", "Controller.AnErrorOf*"),
    (C, "  r.forces_on = r.state == OperatingState::Enabled && r.valid;", "  r.forces_on = true;", "controller", "Controller.AnErrorOf*:Controller.Disabled*"),
    (C, "? std::min(1.0, o.force_limit /", "? (o.force_limit /", "controller", "Controller.AConfigured*"),
    (R, "  if (best <= kTolerance * kTolerance) return true;", "  return true;", "controller", "Controller.WhenTheInstrument*"),
    # Contact models.
    (X, "  if (r.plane_count > shared::kContactPlanes) return", "  if (false) return", "contact_force", "ContactForce.NoRecord*"),
    (X, "    if (!isFinite(x[i])) return false;\n", "", "contact_force", "ContactForce.NoRecord*"),
    (X, "    if (m(i, i) < 0.0) return false;\n", "", "contact_force", "ContactForce.NoRecord*"),
    (X, "      if (!(std::abs(m(i, j)) <= kMostStiffness)) return false;\n", "", "contact_force", "ContactForce.NoRecord*"),
    (X, "  if (!(std::sqrt(m.force.squaredNorm()) <= kMostForce)) return", "  if (false) return", "contact_force", "ContactForce.NoRecord*"),
    (X, "  if (m.radius < 0.0) return", "  if (false) return", "contact_force", "ContactForce.NoRecord*"),
    (X, "    if (!(std::abs(m.normal[i].squaredNorm() - 1.0) < 0.01)) return", "    if (false) return", "contact_force", "ContactForce.NoRecord*"),
    (X, "    if (push <= 0.0) return Vector3d::Zero();\n", "", "contact_force", "ContactForce.TissuePushes*"),
    (X, "  if (m.grasping) return force;\n", "", "contact_force", "ContactForce.WhatIsGrasped*"),
    (X, "  return length > radius ? Vector3d(d * (radius / length)) : d;", "  return radius > 0.0 ? d : d;", "contact_force", "ContactForce.BeyondItsRadius*:ContactForce.Friction*"),
    (X, "  residual_ = before - coupled(model, x, v);\n", "  residual_.setZero();\n", "contact_force", "ContactForce.ANewModel*"),
    # The thread that serves the device.
    (M, "  if (code_ != 0) return DeviceStatus::Error;\n", "", "devices", "Phantom.EachError*"),
    (M, "  return !forcesOn() || old ? Loads{} : w.loads;", "  return old ? Loads{} : w.loads;", "devices", "ForceDimension.Failures*:Phantom.EachError*"),
    (M, "  return !forcesOn() || old ? Loads{} : w.loads;", "  return !forcesOn() ? Loads{} : w.loads;", "devices", "Phantom.AForceThatIsNotRenewed*"),
    (H, "sane ? loads[2] : 0.0", "loads[2]", "devices", "Phantom.AForceBeyond*"),
    (H, "  const bool output = forcesOn() && calibrated_;", "  const bool output = forcesOn();", "devices", "Phantom.EachCalibration*"),
    (H, "    fail(error.code);\n", "", "devices", "Phantom.EachError*"),
    (H, "    hd.disable(kForceOutput);\n    output_ = false;\n    scheduled_ = false;", "    scheduled_ = false;", "devices", "Phantom.EachError*"),
]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tests", required=True, help="folder of haptics_test_*")
    parser.add_argument("--include", nargs="+", default=[], help="include folders")
    parser.add_argument("--compiler", default="c++")
    parser.add_argument("--some", type=int, default=0, help="only so many, spread over the table; 0: all")
    parser.add_argument("--only", default="", help="only entries whose file holds this word")
    args = parser.parse_args()
    table = [m for m in MUTANTS if args.only in m[0]]
    if args.some:
        table = table[:: max(1, len(table) // args.some)][: args.some]
    include = [d for group in args.include for d in group.split(";") if d]
    survived, broken = [], []
    for number, (file, text, other, program, wanted) in enumerate(table, 1):
        label = f"{file}: {text.strip().splitlines()[0]} -> {other.strip().splitlines()[0] if other.strip() else '(gone)'}"
        with open(os.path.join(PACKAGE, file), encoding="utf-8") as f:
            source = f.read()
        if source.count(text) != 1:
            broken.append(f"{label}: found {source.count(text)} times, must be once")
            continue
        with tempfile.TemporaryDirectory() as folder:
            flags = []
            spoiled = os.path.join(folder, os.path.basename(file))
            if file.endswith(".h"):  # in front of the real header
                spoiled = os.path.join(folder, file[len("include/"):])
                os.makedirs(os.path.dirname(spoiled))
                flags = ["-I", folder]
            with open(spoiled, "w", encoding="utf-8") as f:
                f.write(source.replace(text, other))
            unit = spoiled if file.endswith(".cpp") else os.path.join(PACKAGE, C)
            library = os.path.join(folder, "libmutant.so")
            # O1: half the time of O2, the same branches.
            done = subprocess.run([args.compiler, "-std=c++17", "-O1", "-fPIC", "-w", "-ffp-contract=off", *flags,
                                   *(w for d in [os.path.join(PACKAGE, "include"), *include] for w in ("-I", d)), "-shared", unit, "-o", library],
                                  capture_output=True, text=True, check=False)
            if done.returncode != 0:
                broken.append(f"{label}: does not compile: {done.stderr.splitlines()[0] if done.stderr else ''}")
                continue
            try:
                run = subprocess.run([os.path.join(args.tests, "haptics_test_" + program), "--gtest_filter=" + wanted],
                                     env={**os.environ, "LD_PRELOAD": library}, capture_output=True, text=True, timeout=120, check=False)
                red = run.returncode != 0
                ran = "Running 0 tests" not in run.stdout
            except subprocess.TimeoutExpired:
                red = ran = True
        if not ran:
            broken.append(f"{label}: no test is called {wanted}")
        elif not red:
            survived.append(label + "  test: " + wanted)
        print(f"{number:3} {'red     ' if red and ran else 'SURVIVED'} {label}", flush=True)
    for line in broken:
        print("BROKEN ENTRY " + line)
    print(f"mutants: {len(table)} tried, {len(table) - len(survived) - len(broken)} killed, {len(survived)} survived, {len(broken)} entries broken")
    return 1 if survived or broken else 0


if __name__ == "__main__":
    sys.exit(main())
