#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "temporary_scene.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/modelling/session.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/solver/random.h"

// Protects drawing: an edit changes the bytes that it means and no other, undo gives back the same bytes,
// what is refused changes nothing, and only the edited organ is built anew.

using namespace vest::modelling;

namespace {

const std::string kPackage = VEST_TISSUE_SOURCE_DIR;

const std::string kSource =
    R"(# Two vessels, drawn by hand.   The comment stays.
vest_source: 1
name: drawn      # short
objects:
  # the first one
  - name: artery
    organ: artery
    material: artery
    tube:
      centre: [[0.0100, 0, 0.05], [0.02,0.0,0.05],   [0.03, 0, 0.05]]  # odd blanks stay, too
      reference: [0, 0, 1]
      rings: 8
      around: 6
      sections:
        - {at: 0, radii: [0.002]}   # wide
        - at: 1
          radii: [0.001]
    fixed: [{rings: [0, 0]}]

  - name: vein
    organ: vein
    material: vein
    roles:
      - target
      - 'forbidden'
    tube: {centre: [[0.01, 0.01, 0.05], [0.03, 0.01, 0.05]], reference: [0, 0, 1], rings: 6, around: 6, sections: [{at: 0, radii: [0.002]}]}
include:
  - {part: hollow}
)";

Materials materials() {
  static const auto all = readMaterials(kPackage + "/data/materials.yaml");
  return all;
}

Session drawn(const std::string& text = kSource) {
  return {"source.yaml", text, materials()};
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string refusal(Session& session, const std::string& op, const std::string& path,
                    const std::string& value = "") {
  const std::string text = session.text(), hash = session.hash();
  const std::size_t logged = session.log().size();
  try {
    session.apply(op, path, value);
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(session.text(), text);
    EXPECT_EQ(session.hash(), hash);
    EXPECT_EQ(session.log().size(), logged);
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error.what();
  }
  ADD_FAILURE() << op << " " << path << " " << value << " was not refused";
  return "";
}

void expectSays(const std::string& message, const std::string& part) {
  EXPECT_NE(message.find(part), std::string::npos) << "message was: " << message;
}

}  // namespace

TEST(Session, AnEditReplacesTheBytesOfItsValueAlone) {
  Session s = drawn();
  s.apply("set", "/objects/artery/tube/centre/1", "[0.02, 0.001, 0.0500]");
  std::string wanted = replaced(kSource, "[0.02,0.0,0.05]", "[0.02, 0.001, 0.0500]");
  EXPECT_EQ(s.text(), wanted);
  s.apply("set", "/name", "other");
  wanted = replaced(wanted, "name: drawn      # short", "name: other      # short");
  EXPECT_EQ(s.text(), wanted);
  s.apply("set", "/objects/artery/tube/sections/1/radii/0", "0.0015");
  wanted = replaced(wanted, "radii: [0.001]\n", "radii: [0.0015]\n");
  EXPECT_EQ(s.text(), wanted);
  EXPECT_EQ(s.scene().name, "other");
}

TEST(Session, PointsSectionsKeysAndObjectsComeAndGo) {
  Session s = drawn();
  s.apply("insert", "/objects/artery/tube/centre/1", "[0.015, 0, 0.05]");
  std::string wanted = replaced(kSource, "[0.02,0.0,0.05]", "[0.015, 0, 0.05], [0.02,0.0,0.05]");
  EXPECT_EQ(s.text(), wanted);
  s.apply("remove", "/objects/artery/tube/centre/0");
  wanted = replaced(wanted, "[0.0100, 0, 0.05], ", "");
  EXPECT_EQ(s.text(), wanted);
  s.apply("insert", "/objects/artery/tube/sections/1", "{at: 0.5, radii: [0.0018, 0.0017]}");
  wanted = replaced(wanted, "        - at: 1\n",
                    "        - {at: 0.5, radii: [0.0018, 0.0017]}\n        - at: 1\n");
  EXPECT_EQ(s.text(), wanted);
  s.apply("remove", "/objects/artery/tube/sections/2");
  wanted = replaced(wanted, "        - at: 1\n          radii: [0.001]\n", "");
  EXPECT_EQ(s.text(), wanted);
  s.apply("set", "/objects/vein/tube/wall_thickness", "0.0004");
  wanted = replaced(wanted, "radii: [0.002]}]}\n", "radii: [0.002]}], wall_thickness: 0.0004}\n");
  EXPECT_EQ(s.text(), wanted);
  s.apply("set", "/objects/artery/support", "30");
  wanted =
      replaced(wanted, "    fixed: [{rings: [0, 0]}]\n", "    fixed: [{rings: [0, 0]}]\n    support: 30\n");
  EXPECT_EQ(s.text(), wanted);
  expectSays(refusal(s, "remove", "/objects/vein/roles/target"), "is not there; allowed: 0 to 1");
}

TEST(Session, AnObjectIsAddedAsABlockThatReadsLikeTheOthers) {
  Session s = drawn();
  s.apply(
      "insert", "/objects/-",
      "{name: fold, organ: ligament, material: peritoneum, sheet: {stations: 5, height_knots: 4, thickness: "
      "0.002, curves: [[[0, 0.03, 0.05], [0.03, 0.03, 0.05]], [[0, 0.03, 0.07], [0.03, 0.03, 0.07]]]}}");
  EXPECT_EQ(s.text(),
            replaced(kSource, "include:\n",
                     "  - name: fold\n"
                     "    organ: ligament\n"
                     "    material: peritoneum\n"
                     "    sheet:\n"
                     "      stations: 5\n"
                     "      height_knots: 4\n"
                     "      thickness: 0.002\n"
                     "      curves: [[[0, 0.03, 0.05], [0.03, 0.03, 0.05]], [[0, 0.03, 0.07], [0.03, "
                     "0.03, 0.07]]]\n"
                     "include:\n"));
  ASSERT_EQ(s.scene().objects.size(), 4u);
  EXPECT_EQ(s.scene().objects[2].name, "fold");
  EXPECT_EQ(s.rebuilt(), std::vector<std::string>{"fold"});
  s.apply("remove", "/objects/fold");
  EXPECT_EQ(s.text(), kSource);
  s.apply("remove", "/objects/artery");
  s.apply("remove", "/objects/vein");
  EXPECT_EQ(s.scene().objects.size(), 1u);
  EXPECT_NE(s.text().find("objects: []\n"), std::string::npos) << s.text();
  s.apply("insert", "/objects/0",
          "{name: last, organ: vein, material: vein, tube: {centre: [[0,0,0],[0.1,0,0]], reference: [0,0,1], "
          "rings: 6, around: 6, sections: [{at: 0, radii: [0.01]}]}}");
  EXPECT_EQ(s.scene().objects[0].name, "last");
  EXPECT_NE(s.text().find("objects:\n  - name: last\n    organ: vein\n"), std::string::npos) << s.text();
  for (int i = 0; i < 5; ++i) s.apply("undo", "");
  EXPECT_EQ(s.text(), kSource);
}

TEST(Session, OnlyTheEditedObjectAndWhatHangsOnItAreBuiltAnew) {
  const std::string path = kPackage + "/scenes/gynaecology/source.yaml";
  const std::string text = vest::scene::yaml::readFile(path, 1u << 20);
  Session s(path, text, materials());
  s.apply("set", "/objects/tube_left/tube/centre/4", "[-0.0435, 0.0572, 0.0691]");
  EXPECT_EQ(s.rebuilt(), (std::vector<std::string>{"tube_left", "tube_right"})) << "one mirrors the other";
  s.apply("set", "/objects/ovary_left/tube/sections/0/radii/0", "0.0062");
  // The tube gives way to the ovary, and the right ovary is its mirror image.
  EXPECT_EQ(s.rebuilt(), (std::vector<std::string>{"tube_left", "tube_right", "ovary_left", "ovary_right"}))
      << "in scene order";
  const Session fresh(path, s.text(), materials());
  ASSERT_EQ(fresh.scene().objects.size(), s.scene().objects.size());
  for (std::size_t i = 0; i < fresh.scene().objects.size(); ++i)
    EXPECT_EQ(vest::scene::encodeBaked(fresh.scene().objects[i]),
              vest::scene::encodeBaked(s.scene().objects[i]))
        << fresh.scene().objects[i].name;
  EXPECT_EQ(fresh.scene().connections.size(), s.scene().connections.size());
  s.apply("undo", "");
  s.apply("undo", "");
  EXPECT_EQ(s.text(), text);
}

TEST(Session, WhatIsRefusedIsOneLineAndChangesNothing) {
  Session s = drawn();
  expectSays(refusal(s, "set", "/objects/artery/tube/rings", "2"), "must be a whole number from 3 to 1000");
  expectSays(refusal(s, "set", "/objects/artery/tub/rings", "8"), "tub is not there; allowed: name, organ");
  expectSays(refusal(s, "set", "/objects/artery/springs", "17"), "possible with these fillers");
  expectSays(refusal(s, "set", "/objects/artery/spings", "17"), "spings");
  expectSays(refusal(s, "insert", "/objects/artery/tube/centre/9", "[0,0,0]"), "allowed: 0 to 3");
  expectSays(refusal(s, "insert", "/objects/artery/tube/rings", "1"), "no place of a list");
  expectSays(refusal(s, "remove", "/objects/kidney"), "is not there");
  expectSays(refusal(s, "remove", "/objects/artery/name"), "name: missing");
  expectSays(refusal(s, "set", "/objects/artery/name", "vein"), "must be there once");
  expectSays(refusal(s, "set", "/objects/artery/material", "wood"), "is not in the database");
  expectSays(refusal(s, "set", "/name", "a, b"), "must be 1 to 64 of letters");
  expectSays(refusal(s, "set", "/name", "x\nseed: 4"), "");
  expectSays(refusal(s, "set", "/name", "&a x"), "an anchor");
  expectSays(
      refusal(s, "set", "/objects/artery/connect", "[{to: vein, rings: [0, 1], within: 1e-5, stiffness: 1}]"),
      "no knot lies within");
  expectSays(refusal(s, "turn", "/name", "x"), "allowed: set, insert, remove, undo, redo");
  expectSays(refusal(s, "redo", ""), "nothing is left to redo");
  expectSays(refusal(s, "undo", "/name"), "none, the last edit is meant");
  expectSays(refusal(s, "set", "name", "x"), "allowed: /key/key/place");
  expectSays(refusal(s, "set", "/name", std::string(40, '[')), "");
  EXPECT_FALSE(s.canUndo());
}

TEST(Session, UndoAndRedoWalkTheSameBytes) {
  Session s = drawn();
  s.apply("set", "/name", "b");
  s.apply("remove", "/objects/artery/fixed");
  const std::string after = s.text();
  s.apply("undo", "");
  s.apply("undo", "");
  EXPECT_EQ(s.text(), kSource);
  s.apply("redo", "");
  s.apply("redo", "");
  EXPECT_EQ(s.text(), after);
  EXPECT_FALSE(s.canRedo());
  s.apply("undo", "");
  s.apply("set", "/seed", "4");
  EXPECT_FALSE(s.canRedo()) << "a new edit ends what was undone";
}

TEST(Session, WhatItDidPlaysAgainToTheSameHashes) {
  Session s = drawn();
  s.apply("set", "/objects/artery/tube/centre/1", "[0.02, 0.0010, 0.05]");
  s.apply("insert", "/objects/-", "name: b\nmirror_of: vein\n");
  s.apply("undo", "");
  s.apply("redo", "");
  s.apply("remove", "/objects/vein/roles");
  const std::string text = editsText(s.log());
  Session again = drawn();
  play(readEdits("edits.yaml", text), again);
  EXPECT_EQ(again.text(), s.text());
  EXPECT_EQ(editsText(again.log()), text);
  const vest::test::TemporaryScene one, two;
  const std::string first = save(s, one.folder()), second = save(again, two.folder());
  EXPECT_EQ(vest::scene::loadScene(first).hash, vest::scene::loadScene(second).hash);
  Session other = drawn(kSource + "# changed\n");
  EXPECT_THROW(play(readEdits("edits.yaml", text), other), std::invalid_argument);
}

/// Its scene was written, and then refused by the reader of scenes.
TEST(Session, WithoutAnyObjectNothingIsWritten) {
  Session s("source.yaml", "vest_source: 1\nname: drawn\nobjects: []\n", {});
  const vest::test::TemporaryScene place;
  const std::string folder = place.folder() + "/out";
  EXPECT_THROW(save(s, folder), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(folder + "/source.yaml"));
}

/// Each bakes: tens of thousands in a small file kept a reader for minutes.
TEST(Session, AFileHasAtMostTwoThousandEdits) {
  std::string text = "vest_edits: 1\nedits:\n";
  for (int i = 0; i < 2000; ++i) text += "  - {op: undo}\n";
  EXPECT_EQ(readEdits("edits.yaml", text).edits.size(), 2000u);
  try {
    readEdits("edits.yaml", text + "  - {op: undo}\n");
    FAIL() << "one more";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("edits.yaml:2003: edits: more than 2000"), std::string::npos)
        << error.what();
  }
}

/// Each bakes what it changes: two thousand edits of a large tube took hours.
TEST(Session, TheEditsOfAFileBakeAtMostTwoMillionKnots) {
  Session s(
      "source.yaml",
      "vest_source: 1\nname: a\nobjects:\n  - name: tube\n    organ: tube\n    material: tube\n    tube: "
      "{centre: [[0, 0, 0.05], [0.08, 0, 0.05]], reference: [0, 0, 1], rings: 1000, around: 60, sections: "
      "[{at: 0, radii: [0.003]}]}\n    skin: {along: 1, around: 1}\n    fixed: [{rings: [0, 0]}]\n",
      readMaterials(kPackage + "/data/materials.yaml"));
  std::string text = "vest_edits: 1\nedits:\n";
  for (int i = 0; i < 40; ++i)
    text += "  - {op: set, path: /objects/tube/tube/centre/1, value: [0.08" + std::to_string(i % 2 + 1) +
            ", 0, 0.05]}\n";
  std::string message;
  try {
    play(readEdits("edits.yaml", text), s);
  } catch (const std::invalid_argument& error) {
    message = error.what();
  }
  EXPECT_EQ(message.rfind("edits.yaml:37: edits: 20", 0), 0u) << message;
  EXPECT_NE(message.find("knots were baked so far"), std::string::npos) << message;
}

TEST(Session, NearObjectsAreProposedAndTheProposalIsAnEdit) {
  Session s = drawn();
  const auto near = s.propose("vein", 0.009);
  ASSERT_EQ(near.size(), 1u);
  EXPECT_EQ(near[0].to, "artery");
  s.apply("set", near[0].path, near[0].value);
  EXPECT_GT(s.scene().connections.size(), 3u);
  EXPECT_EQ(s.propose("vein", 0.009)[0].path, "/objects/vein/connect/-");
  EXPECT_TRUE(s.propose("vein", 1e-4).empty());
  EXPECT_THROW(s.propose("kidney", 0.01), std::invalid_argument);
}

TEST(Session, ADocumentWithoutAPlaceForEachValueIsRefused) {
  for (const char* text :
       {"vest_source: 1\nname: >\n  a\n", "vest_source: 1\nname:\n", "- a\n", "? name\n: a\n",
        "name: a\n  b\n", "", "\xff\xfe", "vest_source: 1\nname: \"a\nb: {c:"})
    EXPECT_THROW(drawn(text), std::invalid_argument) << text;
  EXPECT_NO_THROW(drawn("\xEF\xBB\xBF" + kSource));
}

// 1,000 edits at random places with values that fit and values that do not, 10^5 with VEST_FULL=1.
TEST(Session, RandomEditsAllUndoneGiveTheSameBytes) {
  const int count = std::getenv("VEST_FULL") != nullptr ? 100000 : 1000;
  std::printf("count: %d of 100000 random edits\n", count);
  Session s = drawn(replaced(kSource, "include:\n  - {part: hollow}\n", ""));
  const std::string start = s.text();
  const std::vector<std::string> paths = {"/name",
                                          "/seed",
                                          "/gravity",
                                          "/gravity/1",
                                          "/objects/artery/tube/centre",
                                          "/objects/artery/tube/centre/0",
                                          "/objects/artery/tube/centre/-",
                                          "/objects/artery/tube/centre/1/2",
                                          "/objects/artery/tube/sections/0",
                                          "/objects/artery/tube/sections/1",
                                          "/objects/artery/tube/sections/-",
                                          "/objects/artery/tube/rings",
                                          "/objects/artery/fixed",
                                          "/objects/artery/fixed/0",
                                          "/objects/artery/support",
                                          "/objects/vein",
                                          "/objects/vein/roles",
                                          "/objects/vein/roles/0",
                                          "/objects/vein/roles/-",
                                          "/objects/vein/tube/wall_thickness",
                                          "/objects/vein/tube/sections/0/radii",
                                          "/objects/vein/tube/sections/0/radii/-",
                                          "/objects/0",
                                          "/objects/-",
                                          "/objects/artery/connect",
                                          "/objects/artery/bumps/-",
                                          "/objects/artery/bumps",
                                          "/",
                                          "",
                                          "//",
                                          "/objects/ ",
                                          "/objects/artery/tube/centre/99999999999"};
  const std::vector<std::string> values = {"1",
                                           "7",
                                           "0.0015",
                                           "0.012",
                                           "[0, 0, -9.81]",
                                           "[0.012, 0.001, 0.05]",
                                           "[[0,0,0],[0.02,0,0]]",
                                           "{at: 0.5, radii: [0.002]}",
                                           "[{at: 0, radii: [0.001]}]",
                                           "[{rings: [0, 1]}]",
                                           "{rings: [0, -1]}",
                                           "word",
                                           "[]",
                                           "{}",
                                           "[target]",
                                           "target",
                                           "\"quoted\"",
                                           "'it''s'",
                                           "#",
                                           "a: b",
                                           "[",
                                           "\x01",
                                           "&a b",
                                           "- a\n- b\n",
                                           "{name: c, mirror_of: vein}",
                                           "[{at: [0,0,0], size: [1,1,1], push: [0,0,0.001]}]",
                                           "1e999",
                                           "-0",
                                           "[{to: vein, rings: [0, 1], within: 0.02, stiffness: 1}]"};
  const char* const ops[] = {"set", "set", "insert", "remove", "undo", "redo"};
  int taken = 0;
  for (int i = 0; i < count; ++i) {
    const auto draw = [&](std::size_t most, std::uint64_t which) {
      return vest::solver::randomBelow(static_cast<std::uint32_t>(most), 7, static_cast<std::uint64_t>(i),
                                       which);
    };
    const std::string op = ops[draw(6, 0)];
    const bool stepping = op[0] == 'u' || op == "redo";
    const std::string before = s.text();
    try {
      s.apply(op, stepping ? "" : paths[draw(paths.size(), 1)],
              stepping || op == "remove" ? "" : values[draw(values.size(), 2)]);
      ++taken;
    } catch (const std::invalid_argument&) {
      ASSERT_EQ(s.text(), before);
    }
  }
  EXPECT_GT(taken, count / 50);
  while (s.canUndo()) s.apply("undo", "");
  EXPECT_EQ(s.text(), start);
}
