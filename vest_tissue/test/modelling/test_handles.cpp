#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include <Eigen/Geometry>

#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/modelling/fields.h"
#include "vest_tissue/modelling/handles.h"
#include "vest_tissue/modelling/library.h"
#include "vest_tissue/modelling/session.h"
#include "vest_tissue/modelling/ties.h"

// Protects what a person edits with: a handle writes back the place where it was dropped, a field knows the
// range by which the reader refuses, and what the library has says where it is from and bakes.

using namespace vest::modelling;

namespace {

namespace fs = std::filesystem;
const std::string kPackage = VEST_TISSUE_SOURCE_DIR;
const std::string kEmpty = "vest_source: 1\nname: drawn\nobjects: []\ninclude:\n  - {part: hollow}\n";

Materials materials() {
  static const auto all = readMaterials(kPackage + "/data/materials.yaml");
  return all;
}

std::string partFile(const std::string& name) {
  return find(readLibrary(), name, "part").file;
}

Session withPart(const std::string& name) {
  Session session("source.yaml", kEmpty, materials());
  for (const Script::Line& line : additions(session.document(), partFile(name)))
    session.apply(line.op, line.path, line.value);
  return session;
}

SceneSource alone(const Session& session, const std::string& object) {
  return readAlone(session.document().bytes("/objects/" + object));
}

}  // namespace

TEST(Handles, EachOneIsFoundWhereItWasDropped) {
  for (const std::string part : {"tube", "bowel", "fold", "pouch", "vessel_tree", "supply_tree"}) {
    SCOPED_TRACE(part);
    Session session = withPart(part);
    const std::vector<Handle> handles = handlesOf(alone(session, part));
    ASSERT_FALSE(handles.empty());
    for (const Handle& handle : handles) {
      SCOPED_TRACE(handle.path);
      // A millimetre along the axis; a radius of 0 on the axis stays there.
      const bool pole = handle.kind == Handle::Kind::Profile && handle.place == handle.origin;
      const Vector3 to =
          handle.place + 0.001 * handle.axis + (pole ? Vector3(0, 0, 0) : 0.0005 * handle.across);
      const std::string before = session.text();
      session.apply("set", "/objects/" + part + handle.path, valueAt(handle, to));
      bool found = false;
      for (const Handle& after : handlesOf(alone(session, part))) {
        if (after.path != handle.path) continue;
        found = true;
        if (handle.kind == Handle::Kind::Length)
          EXPECT_NEAR((after.place - after.origin).norm(), (to - handle.origin).dot(handle.axis), 1e-5);
        else if (handle.kind == Handle::Kind::Direction)
          EXPECT_LT((after.place - after.origin).normalized().cross((to - handle.origin).normalized()).norm(),
                    2e-5);
        else
          EXPECT_LT((after.place - to).norm(), 2e-5);
      }
      EXPECT_TRUE(found);
      session.apply("undo", "");
      EXPECT_EQ(session.text(), before);
    }
  }
}

TEST(Handles, PointsAreInsertedOnTheCurveAndRemoved) {
  Session session = withPart("tube");
  const std::vector<Handle> handles = handlesOf(alone(session, "tube"));
  const Curve before(alone(session, "tube").objects[0].tube->centre);
  for (const Handle& handle : handles) {
    if (handle.insert_path.empty()) continue;
    session.apply("insert", "/objects/tube" + handle.insert_path, handle.insert_value);
    EXPECT_EQ(handlesOf(alone(session, "tube")).size(), handles.size() + 1) << handle.path;
    session.apply("undo", "");
    if (handle.remove_path.empty()) continue;
    session.apply("remove", "/objects/tube" + handle.remove_path, "");
    EXPECT_LT(handlesOf(alone(session, "tube")).size(), handles.size()) << handle.path;
    session.apply("undo", "");
  }
}

TEST(Handles, LinesShowTheCurveThatIsDrawn) {
  const Session session = withPart("tube");
  const auto lines = linesOf(alone(session, "tube"));
  ASSERT_EQ(lines.size(), 3u) << "the centre and two cross-sections";
  for (const Vector3& p : lines[1]) EXPECT_NEAR((p - lines[0].front()).norm(), 0.003, 1e-6);
  EXPECT_EQ(linesOf(alone(withPart("vessel_tree"), "vessel_tree")).size(), 3u) << "a line a branch";
}

namespace {

std::vector<Laid> laidOf(const Session& session) {
  std::vector<Laid> scene;
  for (const auto& object : session.scene().objects)
    scene.push_back({object.name,
                     object.model == vest::scene::ObjectModel::Rigid,
                     object.rest_position,
                     {object.tube.rings.begin(), object.tube.rings.end()},
                     {object.fixed.begin(), object.fixed.end()}});
  return scene;
}

const Laid& of(const std::vector<Laid>& scene, const std::string& name) {
  return *std::find_if(scene.begin(), scene.end(), [&](const Laid& o) { return o.name == name; });
}

}  // namespace

TEST(Ties, OneIsMadeWhereAPointLiesMovedAlongTheOrganToAnotherOneAndRemoved) {
  Session session = withPart("tube");
  const std::string empty = session.text();
  const auto tube = alone(session, "tube").objects[0];
  const Vector3 first = tube.tube->centre.front(), last = tube.tube->centre.back();
  ASSERT_FALSE(tieFrom(first, of(laidOf(session), "tube"), laidOf(session))) << "the hollow is no organ";
  // Two neighbours, one near each end.
  const auto vein = [&](const std::string& name, const Vector3& at) {
    char text[400];
    std::snprintf(
        text, sizeof text,
        "{name: %s, organ: vein, material: vein, support: 30, fixed: [{rings: [0, 1]}], tube: {centre: "
        "[[%g, %g, %g], [%g, %g, %g]], sections: [{at: 0, radii: [0.002]}], reference: [1, 0, 0], "
        "rings: 8, around: 6}}",
        name.c_str(), at.x(), at.y(), at.z(), at.x(), at.y(), at.z() + 0.02);
    session.apply("insert", "/objects/-", text);
  };
  vein("near_first", first + Vector3(0, 0, 0.008));
  vein("near_last", last + Vector3(0, 0, 0.008));
  auto scene = laidOf(session);
  const bool list = session.document().has("/objects/tube/connect");
  const std::string rule = textOf(*tieFrom(first, of(scene, "tube"), scene));
  EXPECT_NE(rule.find("to: near_first, rings: [2, 2]"), std::string::npos) << rule << ": two are fixed";
  session.apply(list ? "insert" : "set", std::string("/objects/tube/connect") + (list ? "/-" : ""),
                list ? rule : "[" + rule + "]");
  ASSERT_FALSE(session.scene().connections.empty()) << "what lies within is tied";

  const auto tie = [&] {
    return tiesOf(alone(session, "tube").objects[0].connections, of(laidOf(session), "tube"), laidOf(session))
        .back();
  };
  EXPECT_LT((tie().own - first).norm(), 0.01);
  EXPECT_LT((tie().other - first - Vector3(0, 0, 0.008)).norm(), 0.004);
  // The other end is dropped on the other vein, the own end beside it.
  const std::string path = "/objects/tube" + tie().path;
  ConnectRule moved = otherEndAt(tie(), last + Vector3(0, 0, 0.015), of(scene, "tube"), scene);
  EXPECT_EQ(moved.to, "near_last");
  session.apply("set", path, textOf(moved));
  moved = ownEndAt(tie(), last, of(scene, "tube"), scene);
  EXPECT_EQ(moved.rings.last, static_cast<int>(tube.tube->rings) - 3) << "two are fixed";
  session.apply("set", path, textOf(moved));
  EXPECT_LT((tie().own - last).norm(), 0.01);
  session.apply("remove", path);
  EXPECT_TRUE(alone(session, "tube").objects[0].connections.empty());
  while (session.canUndo() && session.text() != empty) session.apply("undo", "");
  EXPECT_EQ(session.text(), empty);
}

TEST(Ties, RingsOfARuleKeepTheirNumberAndStayOnTheOrgan) {
  Laid own{"own", false, {}, {}};
  for (std::uint32_t k = 0; k < 10; ++k) own.knots.push_back({0.01 * k, 0, 0}), own.rings.push_back({k});
  const Laid other{"other", false, {{0.05, 0.01, 0}}, {}};
  ConnectRule rule;
  rule.to = "other";
  rule.rings = {-4, -2, 2, 0};
  const auto ties = tiesOf({rule}, own, {own, other});
  ASSERT_EQ(ties.size(), 1u);
  const auto dropped = [&](double x) { return textOf(ownEndAt(ties[0], {x, 0, 0}, own, {own, other})); };
  EXPECT_EQ(dropped(0.031), "{to: other, rings: [2, 4, 2], per_ring: 1, within: 0.0317, stiffness: 0}");
  EXPECT_EQ(dropped(-1).find("{to: other, rings: [0, 2, 2]"), 0u);
  EXPECT_EQ(dropped(1).find("{to: other, rings: [7, 9, 2]"), 0u);
  rule.rings = {3, 12, 1, 0};
  EXPECT_TRUE(tiesOf({rule}, own, {own, other}).empty()) << "beyond the last ring";
  rule.rings = {0, 1, 1, 0}, rule.to = "gone";
  EXPECT_TRUE(tiesOf({rule}, own, {own, other}).empty());
}

TEST(Fields, RangesAreThoseByWhichTheReaderRefuses) {
  // Each number of these objects, set beyond both ends of its range, is refused; at the ends it is not
  // refused for its range.
  for (const std::string part : {"tube", "bowel", "fold", "pouch", "vessel_tree", "supply_tree"}) {
    Session session = withPart(part);
    for (const Entry& entry : entriesOf(session.document(), part)) {
      if (entry.field == nullptr) continue;
      const Field& field = *entry.field;
      if (field.kind != Field::Kind::Number && field.kind != Field::Kind::Whole) continue;
      if (!entry.value.empty() && entry.value[0] == '[') continue;
      SCOPED_TRACE(part + ": " + entry.path);
      const double span = std::max(1.0, field.most - field.least);
      for (const double value : {field.least - 0.01 * span - 1, field.most + 0.01 * span + 1}) {
        char text[40];
        std::snprintf(text, sizeof text, "%.0f", value);
        try {
          session.apply("set", "/objects/" + part + "/" + entry.path, text);
          ADD_FAILURE() << text << " was taken";
          session.apply("undo", "");
        } catch (const std::invalid_argument&) {
        }
      }
    }
  }
  EXPECT_EQ(fieldOf("nonsense"), nullptr);
  EXPECT_EQ(fieldOf("tube/sections/x/at"), nullptr);
  EXPECT_EQ(allowedText(*fieldOf("tube/sections/12/at")), "0 … 1");
  EXPECT_EQ(allowedText(*fieldOf("tube/rings")), "whole, 3 … 1000");
  EXPECT_STREQ(fieldOf("tube/sections/0/radii")->unit, "m") << "a list goes by its numbers";
}

TEST(Fields, EntriesAreWhatTheTextSaysAndWhatItMaySay) {
  const Document document(kEmpty.substr(0, kEmpty.find("objects")) +
                          "objects:\n  - name: a\n    organ: vein\n    material: vein   # soft\n"
                          "    tube: {centre: [[0, 0, 0.05],[0.02,0,0.05]], rings: 6}\n"
                          "  - {name: b, mirror_of: a}\n");
  const auto objects = objectsOf(document);
  ASSERT_EQ(objects.size(), 2u);
  EXPECT_EQ(objects[0].kind + objects[0].material, "tubevein");
  EXPECT_EQ(objects[1].kind, "mirror of a");
  std::map<std::string, Entry> entries;
  for (const Entry& entry : entriesOf(document, "a")) entries.emplace(entry.path, entry);
  EXPECT_EQ(entries.at("tube/centre/1").value, "[0.02, 0, 0.05]");
  EXPECT_EQ(entries.at("material").value, "vein");
  EXPECT_EQ(entries.at("friction").value, "") << "not said";
  EXPECT_EQ(entries.count("tube/wall_thickness"), 1u);
  EXPECT_EQ(entries.count("sheet/stations"), 0u) << "of a shape that it does not have";
  EXPECT_THROW(entriesOf(document, "c"), std::invalid_argument);
}

TEST(Library, NothingIsLeftOutAndEachEntrySaysWhereItIsFrom) {
  const std::vector<LibraryEntry> entries = readLibrary(kPackage + "/library/index.yaml");
  std::set<std::string> listed;
  for (const LibraryEntry& entry : entries) {
    EXPECT_FALSE(entry.licence.empty() || entry.source.empty() || entry.about.empty()) << entry.name;
    if (!entry.file.empty()) listed.insert(fs::canonical(entry.file));
  }
  std::set<std::string> pictures;
  for (const LibraryEntry& entry : entries) {
    EXPECT_EQ(entry.picture.empty(), entry.kind != "part" && entry.kind != "scene") << entry.name;
    if (!entry.picture.empty()) pictures.insert(fs::canonical(entry.picture));
  }
  for (const auto& file : fs::directory_iterator(kPackage + "/library/pictures"))
    EXPECT_EQ(pictures.count(fs::canonical(file.path())), 1u) << file.path() << " is of no entry";
  std::size_t seen = 0;
  const auto see = [&](const fs::path& file) {
    ++seen;
    EXPECT_EQ(listed.count(fs::canonical(file)), 1u) << file << " is not in the index";
  };
  for (const char* folder : {"library/models", "library/tables", "data/parts"})
    for (const auto& file : fs::directory_iterator(kPackage + "/" + folder)) see(file.path());
  for (const auto& folder : fs::directory_iterator(kPackage + "/scenes"))
    see(folder.path() / (folder.path().filename().string() + ".yaml"));
  EXPECT_GT(seen, 30u);
  EXPECT_EQ(find(entries, "liver").kind, "material");
  EXPECT_THROW(find(entries, "tube"), std::invalid_argument) << "a part, a scene and a material";
  EXPECT_EQ(find(entries, "tube", "scene").kind, "scene");
}

TEST(Library, ACheckNamesTheEntryAndItsFault) {
  const std::string file = testing::TempDir() + "/vest_library_bad.yaml";
  FILE* const out = std::fopen(file.c_str(), "w");
  std::fputs("vest_part: 1\nobjects:\n  - {name: bag, organ: vein, material: nowhere}\n", out);
  std::fclose(out);
  std::vector<LibraryEntry> entries = readLibrary();
  entries.erase(std::remove_if(entries.begin(), entries.end(),
                               [](const LibraryEntry& e) {
                                 return e.kind == "scene" && e.name != "tube" && e.name != "cut_tube";
                               }),
                entries.end());
  EXPECT_TRUE(faultsOf(entries).empty()) << faultsOf(entries).front();
  for (LibraryEntry& entry : entries) {
    if (entry.kind == "scene" && entry.name == "tube") entry.picture.clear();
    if (entry.kind == "scene" && entry.name == "cut_tube") entry.file = file;
    if (entry.kind == "table" && entry.name == "bone") entry.file = file;
    if (entry.kind == "part" && entry.name == "pouch") entry.file = file;
  }
  const std::vector<std::string> faults = faultsOf(entries);
  ASSERT_EQ(faults.size(), 4u);
  for (const char* const entry : {"part pouch: ", "scene tube: picture", "scene cut_tube: ", "table bone: "})
    EXPECT_EQ(std::count_if(faults.begin(), faults.end(),
                            [&](const std::string& fault) { return fault.rfind(entry, 0) == 0; }),
              1)
        << entry;
  fs::remove(file);
}

TEST(Library, PartsAreAddedTwiceUnderNamesOfTheirOwnAndUndoneByteForByte) {
  Session session("source.yaml", kEmpty, materials());
  std::size_t edits = 0;
  for (const LibraryEntry& entry : readLibrary()) {
    if (entry.kind != "part" || entry.name == "hollow") continue;
    SCOPED_TRACE(entry.name);
    for (const double shift : {0.0, 0.004}) {
      for (const Script::Line& line : additions(session.document(), entry.file, "", Vector3(0, 0, shift))) {
        session.apply(line.op, line.path, line.value);
        ++edits;
      }
    }
    EXPECT_TRUE(session.document().has("/objects/" + entry.name));
    const std::string second =
        entry.name + ((entry.name == "vessel_tree" || entry.name == "supply_tree") ? "_no2" : "_2");
    ASSERT_TRUE(session.document().has("/objects/" + second));
    const auto at = [&](const std::string& name) { return handlesOf(alone(session, name)).front().place; };
    EXPECT_LT((at(second) - at(entry.name) - Vector3(0, 0, 0.004)).norm(), 2e-5);
  }
  for (std::size_t i = 0; i < edits; ++i) session.apply("undo", "");
  EXPECT_EQ(session.text(), kEmpty);
}

TEST(Library, NamesWithinAPartGoTogether) {
  const std::string folder = testing::TempDir() + "/vest_library_test";
  fs::create_directories(folder);
  const std::string file = folder + "/pair.yaml";
  FILE* out = std::fopen(file.c_str(), "w");
  std::fputs(
      "vest_part: 1\nobjects:\n"
      "  - {name: bag, organ: vein, material: vein, tube: {centre: [[0, 0, 0.05], [0.02, 0, 0.05]], "
      "reference: "
      "[0, 0, 1], rings: 6, around: 6, sections: [{at: 0, radii: [0.004]}]}, fixed: [{rings: [0, 0]}]}\n"
      "  - {name: other, mirror_of: bag, connect: [{to: bag, rings: [0, 1], within: 0.02, stiffness: 1}]}\n",
      out);
  std::fclose(out);
  const Document source(kEmpty);
  const auto edits = additions(source, file, "mine");
  ASSERT_EQ(edits.size(), 2u);
  EXPECT_NE(edits[0].value.find("name: mine,"), std::string::npos) << edits[0].value;
  EXPECT_NE(edits[1].value.find("name: mine_other, mirror_of: mine,"), std::string::npos) << edits[1].value;
  EXPECT_NE(edits[1].value.find("to: mine,"), std::string::npos) << edits[1].value;
  EXPECT_EQ(edits[0].value.find("organ: mine"), std::string::npos);
  fs::remove_all(folder);
}
