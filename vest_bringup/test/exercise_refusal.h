#pragma once

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "play.h"
#include "vest_bringup/exercise/engine.h"
#include "vest_bringup/ros/exercise_file.h"
#include "vest_instruments/files/read.h"

namespace vest::exercise {

/// What is said of the shipped file with one text replaced by another.
inline std::string refusal(const std::string& from, const std::string& to) {
  const std::string file = ros_shell::exerciseFile("clip_cut_tube");
  std::string text = files::read(file, 1U << 20U);
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  try {
    const Exercise e = parseExercise(file, text);
    simulation::Play p(e.scene, e.pass_script.file);
    addExercise(e, p.stage);
  } catch (const std::invalid_argument& why) {
    EXPECT_EQ(std::string(why.what()).rfind(file, 0), 0U) << why.what();
    EXPECT_EQ(std::string(why.what()).find('\n'), std::string::npos) << why.what();
    return why.what();
  }
  return "accepted";
}

}  // namespace vest::exercise
