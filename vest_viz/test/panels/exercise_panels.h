#pragma once

// Rest of test_panels.cpp, in one translation unit with what it shares: protects the panels and the rim of
// exercises. What they show is what the topics say, and what a teacher clicks is an input that is recorded.

#include <QLineEdit>
#include <QMouseEvent>
#include <QPainter>

#include <vest_msgs/ExerciseActionGoal.h>
#include <vest_msgs/SelectSource.h>

#include "exercise_panel.h"
#include "exercise_rim.h"
#include "image_pane.h"
#include "teacher_panel.h"

namespace vest::panels {
namespace {

/// The line of text that is no part of another box.
QLineEdit* lineOf(const QWidget& panel) {
  for (QLineEdit* const line : panel.findChildren<QLineEdit*>())
    if (!line->placeholderText().isEmpty()) return line;
  return nullptr;
}

vest_msgs::SessionScore scoreOfPhase(std::uint32_t number, const std::string& phase) {
  vest_msgs::SessionScore m;
  m.exercise = "clip_cut_tube", m.title = "Clip and cut a tube";
  m.phase = phase, m.phase_number = number, m.phases = 2;
  m.elapsed = 83, m.limit = 120;
  m.force = {0, 0.42, 0};
  m.items.resize(2);
  m.items[0].name = "clip_place", m.items[0].value = 1.25, m.items[0].unit = "mm", m.items[0].points = 80;
  m.items[1].name = "economy", m.items[1].value = 310, m.items[1].unit = "mm", m.items[1].points = 97;
  return m;
}

TEST(Exercise, StartsOneAndShowsHowItGoes) {
  Shown<ExercisePanel> shown;
  button(shown.panel, "Start")->click();
  EXPECT_TRUE(shown.says("nobody offers this action"));
  vest_msgs::ExerciseActionGoal goal;
  const ros::Subscriber goals = ros::NodeHandle("/vest").subscribe<vest_msgs::ExerciseActionGoal>(
      "session/exercise/goal", 1, [&](const vest_msgs::ExerciseActionGoalConstPtr& m) { goal = *m; });
  ASSERT_TRUE(spin([&] { return goals.getNumPublishers() > 0; }));
  shown.panel.findChild<QComboBox*>()->setCurrentText("clip_cut_tube");
  lineOf(shown.panel)->setText("anna");
  ASSERT_TRUE(spin([&] {
    button(shown.panel, "Start")->click();
    return !goal.goal.exercise.empty();
  }));
  EXPECT_EQ(goal.goal.exercise, "clip_cut_tube");
  EXPECT_EQ(goal.goal.trainee, "anna");
  EXPECT_FALSE(shown.says("nobody offers"));

  vest_msgs::SessionScore score = scoreOfPhase(1, "clip");
  ASSERT_TRUE(send("session/score", score, [&] { return shown.says("1 of 2: clip"); }));
  EXPECT_TRUE(shown.panel.findChild<QProgressBar*>()->text().contains("83 s of 120 s"));
  auto* const items = shown.panel.findChild<QTableWidget*>();
  ASSERT_EQ(items->rowCount(), 2);
  EXPECT_EQ(items->item(0, 0)->text(), "clip place");
  EXPECT_EQ(items->item(0, 1)->text(), "1.25 mm");
  shown.panel.resize(560, 260);
  shown.keep("exercise");
  score.phase.clear(), score.finished = true, score.total = 12;
  score.failed_by = {"The vessel was <cut> first."}, score.flags = {"assisted"};
  ASSERT_TRUE(send("session/score", score, [&] { return shown.says("NOT PASSED"); }));
  EXPECT_TRUE(shown.says("The vessel was &lt;cut&gt; first.")) << "texts of a file are no markup";
  EXPECT_TRUE(shown.says("assisted"));
}

TEST(Teacher, WhatIsClickedIsAnInputThatTheRecordingKeeps) {
  Shown<TeacherPanel> shown;
  std::vector<vest_msgs::ParameterEdit> edits;
  std::vector<std::string> notes;
  ros::NodeHandle vest("/vest");
  const ros::Subscriber edit_sub = vest.subscribe<vest_msgs::ParameterEdit>(
      "parameter_edit", 10, [&](const vest_msgs::ParameterEditConstPtr& m) { edits.push_back(*m); });
  const ros::Subscriber note_sub = vest.subscribe<vest_msgs::StringStamped>(
      "session/notes", 10, [&](const vest_msgs::StringStampedConstPtr& m) { notes.push_back(m->string); });
  vest_msgs::TissueTopology topology;
  topology.scene_hash = "7";
  topology.objects.resize(2);
  topology.objects[0].name = "artery", topology.objects[0].vessel_segment = "ovarian_artery_left";
  topology.objects[0].centre_line_station = {0, 0.02f, 0.04f};
  topology.objects[1].name = "slab";
  auto* const vessels = shown.panel.findChildren<QComboBox*>()[0];
  ASSERT_TRUE(send("tissue/topology", topology, [&] { return vessels->count() == 1; }));
  ASSERT_TRUE(spin([&] { return edit_sub.getNumPublishers() > 0 && note_sub.getNumPublishers() > 0; }));
  // What is sent, object parameter value; waits for as many.
  const auto sent = [&](const QString& clicked, std::size_t count) {
    edits.clear();
    button(shown.panel, clicked)->click();
    spin([&] { return edits.size() >= count; });
    std::string all;
    for (const auto& e : edits) {
      char text[100];
      std::snprintf(text, sizeof text, "%s %s %.3g;", e.object.c_str(), e.parameter.c_str(), e.value);
      all += text;
    }
    return all;
  };
  EXPECT_EQ(sent("Make it bleed", 2), "artery opening_station 0.02;artery opening_area 1e-06;");
  EXPECT_EQ(sent("Fog the lens", 1), "lens temperature 293;");
  EXPECT_EQ(sent("Fail", 1), " monopolar_power 0;");
  EXPECT_EQ(sent("Mend", 1), " monopolar_power 30;");
  EXPECT_EQ(sent("Pause", 1), "exercise assisted 1;");

  vest_msgs::SelectSource::Request select;
  const ros::ServiceServer service =
      vest.advertiseService<vest_msgs::SelectSource::Request, vest_msgs::SelectSource::Response>(
          "select_source",
          [&](vest_msgs::SelectSource::Request& req, vest_msgs::SelectSource::Response& res) {
            select = req;
            return res.success = true;
          });
  vest_msgs::InstrumentStates instruments;
  instruments.instruments.resize(1);
  instruments.instruments[0].name = "endoscope";
  instruments.instruments[0].source = vest_msgs::InstrumentState::SOURCE_TELEOP;
  EXPECT_EQ(sent("Take the camera", 1), "exercise assisted 1;");
  ASSERT_TRUE(spin([&] { return select.instrument == "endoscope"; }));
  EXPECT_EQ(select.source, vest_msgs::InstrumentState::SOURCE_TELEOP);
  EXPECT_TRUE(send("tissue/instruments", instruments,
                   [&] { return button(shown.panel, "Give the camera back") != nullptr; }));
  lineOf(shown.panel)->setText("Clip the near side first");
  shown.keep("teacher");
  EXPECT_EQ(sent("Tell", 1), "exercise assisted 1;");
  ASSERT_TRUE(spin([&] { return !notes.empty(); }));
  EXPECT_EQ(notes[0], "Clip the near side first");
}

/// Pixels of a teacher's yellow.
int inkPixels(QWidget& pane, const QRect& in) {
  const QImage picture = pane.grab().toImage();
  int count = 0;
  for (int y = in.top(); y <= in.bottom(); ++y)
    for (int x = in.left(); x <= in.right(); ++x) {
      const QRgb p = picture.pixel(x, y);
      count += qRed(p) > 200 && qGreen(p) > 160 && qBlue(p) < 140;
    }
  return count;
}

/// A pane that shows tissue's red.
struct Pane : displays::ImagePane {
  explicit Pane(int width = 720) {
    resize(width, 576);
    QImage tissue(720, 576, QImage::Format_RGB32);
    tissue.fill(QColor(150, 60, 50));
    ImagePane::show(tissue);
  }
  bool add(const visualization_msgs::ImageMarker& mark, double now) {
    bool shown = false;
    marks([&](displays::DrawnMarks& all) { return shown = all.add(mark, now); });
    return shown;
  }
  bool tick(double now) {
    bool gone = false;
    marks([&](displays::DrawnMarks& all) { return gone = all.tick(now); });
    return gone;
  }
};

visualization_msgs::ImageMarker circleAt(double x, double y, float diameter) {
  visualization_msgs::ImageMarker m;
  m.type = visualization_msgs::ImageMarker::CIRCLE;
  m.position.x = x, m.position.y = y, m.scale = diameter;
  m.outline_color.r = 1, m.outline_color.g = 0.84f, m.outline_color.b = 0.35f;
  return m;
}

TEST(Drawing, LiesOverThePictureForATimeAndNothingThatIsBrokenDoes) {
  for (const int width : {720, 1000}) {
    Pane pane(width);
    const int left = (width - 720) / 2;
    const QRect all(0, 0, width, 576), round(left + 180 - 62, 288 - 62, 125, 125),
        inside(left + 160, 268, 40, 40);
    EXPECT_EQ(inkPixels(pane, all), 0);
    ASSERT_TRUE(pane.add(circleAt(0.25, 0.5, 0.2f), 0));
    EXPECT_GT(inkPixels(pane, round), 600) << "a circle of 115 pixels, 4 wide";
    EXPECT_EQ(inkPixels(pane, all), inkPixels(pane, round)) << "and nothing beside it";
    EXPECT_EQ(inkPixels(pane, inside), 0);
    EXPECT_FALSE(pane.tick(7.9));
    EXPECT_TRUE(pane.tick(8.1));
    EXPECT_EQ(inkPixels(pane, all), 0);
  }
  Pane pane;
  auto brief = circleAt(0.5, 0.5, 0.2f), long_lived = brief, line = brief;
  brief.lifetime = ros::Duration(1), long_lived.lifetime = ros::Duration(1e6);
  EXPECT_TRUE(pane.add(brief, 0) && pane.add(long_lived, 0));
  EXPECT_TRUE(pane.tick(1.1));
  EXPECT_TRUE(pane.tick(61));
  line.type = visualization_msgs::ImageMarker::LINE_STRIP;
  std::vector<visualization_msgs::ImageMarker> broken(8, line);
  broken[0] = circleAt(std::nan(""), 0.5, 0.1f), broken[1] = circleAt(0.5, 1.5, 0.1f);
  broken[2] = circleAt(0.5, 0.5, -1), broken[3] = circleAt(0.5, 0.5, std::nanf(""));
  broken[4].points.resize(501), broken[5].points.resize(1), broken[6].points.resize(2);
  broken[6].points[1].x = 1e30;
  broken[7].type = visualization_msgs::ImageMarker::POLYGON, broken[7].points.resize(3);
  for (std::size_t i = 0; i < broken.size(); ++i) EXPECT_FALSE(pane.add(broken[i], 100)) << i;
  for (int i = 0; i < 1000; ++i) pane.add(circleAt(0.5, 0.5, 0.1f), 100);
  EXPECT_GT(inkPixels(pane, QRect(0, 0, 720, 576)), 100) << "a flood keeps the newest";
}

TEST(Drawing, IsWhatTheMouseDrewInThePartsOfThePictureWhereItWas) {
  Pane teacher(1000), trainee;
  std::vector<visualization_msgs::ImageMarker> sent;
  const auto mouse = [&teacher](QEvent::Type type, QPoint at, Qt::MouseButton button) {
    QMouseEvent event(type, at, button, Qt::LeftButton, Qt::NoModifier);
    QApplication::sendEvent(&teacher, &event);
  };
  const auto drag = [&](displays::Stroke pen) {
    teacher.draw(pen, [&](const visualization_msgs::ImageMarker& m) { sent.push_back(m); });
    mouse(QEvent::MouseButtonPress, {140 + 180, 144}, Qt::LeftButton);
    mouse(QEvent::MouseMove, {140 + 270, 216}, Qt::NoButton);
    if (pen != displays::Stroke::None)
      EXPECT_GT(inkPixels(teacher, teacher.rect()), 100) << "seen while it is drawn";
    mouse(QEvent::MouseButtonRelease, {140 + 360, 288}, Qt::LeftButton);
    EXPECT_EQ(inkPixels(teacher, teacher.rect()), 0) << "then it comes as everybody's does";
  };
  drag(displays::Stroke::None);
  EXPECT_TRUE(sent.empty()) << "without a pen the mouse is the host's";
  for (const displays::Stroke pen :
       {displays::Stroke::Line, displays::Stroke::Arrow, displays::Stroke::Circle}) {
    sent.clear();
    drag(pen);
    ASSERT_EQ(sent.size(), 1U);
    ASSERT_TRUE(trainee.add(sent[0], 0));
    const int begin = inkPixels(trainee, QRect(170, 134, 20, 20)),
              end = inkPixels(trainee, QRect(340, 268, 40, 40)),
              beside = inkPixels(trainee, QRect(500, 10, 200, 560));
    EXPECT_EQ(begin > 10, pen != displays::Stroke::Circle) << "the mouse went down at its centre";
    EXPECT_GT(end, pen == displays::Stroke::Arrow ? 150 : 40);
    EXPECT_EQ(beside, 0);
    if (!g_pictures.isEmpty())
      trainee.grab().save(g_pictures + QString("/drawn_%1.png").arg(static_cast<int>(pen)));
    trainee.tick(100);
  }
}

/// Pixels of a colour's kind where the rim draws over black.
int brightPixels(const QImage& picture, const QRect& in) {
  int count = 0;
  for (int y = in.top(); y <= in.bottom(); ++y)
    for (int x = in.left(); x <= in.right(); ++x) count += qGray(picture.pixel(x, y)) > 100;
  return count;
}

TEST(Rim, TellsPhaseClockForcesWordsAndTheResultEachInItsPlace) {
  displays::ExerciseRim rim;
  const auto drawn = [&](const char* name) {
    QImage picture(720, 576, QImage::Format_RGB32);
    picture.fill(Qt::black);
    QPainter painter(&picture);
    rim.paint(&painter, picture.rect());
    painter.end();
    if (!g_pictures.isEmpty()) picture.save(g_pictures + "/" + name + ".png");
    return picture;
  };
  const QRect top_left(0, 0, 240, 40), top(240, 0, 240, 40), top_right(480, 0, 240, 40),
      middle(0, 60, 720, 80), bottom_right(480, 480, 240, 56), bottom(0, 536, 720, 40);
  EXPECT_EQ(brightPixels(drawn("rim_empty"), QRect(0, 0, 720, 576)), 0) << "no exercise, nothing drawn";
  rim.instruct("Set two clips on the vessel, one on each mark.");
  rim.score(scoreOfPhase(1, "clip"), 0);
  QImage now = drawn("rim_phase");
  for (const QRect& place : {top_left, top_right, bottom_right, bottom})
    EXPECT_GT(brightPixels(now, place), 30);
  EXPECT_EQ(brightPixels(now, top), 0);
  rim.score(scoreOfPhase(2, "cut"), 10);
  rim.teacherSays("Clip the near side first", 10);
  now = drawn("rim_done");
  EXPECT_GT(brightPixels(now, top), 30) << "clip: done";
  EXPECT_GT(brightPixels(now, middle), 30) << "the teacher's words";
  EXPECT_FALSE(rim.tick(11));
  EXPECT_TRUE(rim.tick(13));
  EXPECT_EQ(brightPixels(drawn("rim_later"), top), 0) << "a phase's end is shown for a while";
  EXPECT_TRUE(rim.tick(19));
  EXPECT_EQ(brightPixels(drawn("rim_quiet"), middle), 0);
  vest_msgs::SessionScore end = scoreOfPhase(0, "");
  end.finished = true, end.total = 42, end.failed_by = {"The vessel was cut before two clips closed it."};
  rim.score(end, 20);
  rim.instruct("");
  now = drawn("rim_end");
  EXPECT_GT(brightPixels(now, middle), 200) << "the result, large";
  EXPECT_EQ(brightPixels(now, top_left), 0);
  EXPECT_FALSE(rim.tick(39));
  EXPECT_TRUE(rim.tick(41));
  EXPECT_EQ(brightPixels(drawn("rim_over"), QRect(0, 0, 720, 576)), 0) << "the next scene may have none";
  rim.score(end, 42);
  rim.score(scoreOfPhase(1, "clip"), 50);
  EXPECT_EQ(brightPixels(drawn("rim_again"), middle), 0) << "begun anew";
  rim.clear();
  EXPECT_EQ(brightPixels(drawn("rim_cleared"), QRect(0, 0, 720, 576)), 0);
}

}  // namespace
}  // namespace vest::panels
