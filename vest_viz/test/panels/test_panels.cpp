// Protects the panels: what they show is what the topics say, what is clicked reaches the right service or
// topic, a refusal is told in the words of the node that refused, and none of it needs a node that is there.
#include <gtest/gtest.h>

#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <ctime>
#include <functional>

#include <QApplication>
#include <QComboBox>
#include <QDir>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <QTableWidget>

#include <ros/package.h>
#include <ros/ros.h>
#include <rviz/yaml_config_reader.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>
#include <vest_msgs/ExchangeTool.h>
#include <vest_msgs/ParameterEdit.h>
#include <vest_msgs/SetSpeed.h>
#include <vest_msgs/StringStamped.h>

#include "../spin.h"
#include "events_panel.h"
#include "footswitches_panel.h"
#include "haptics_panel.h"
#include "instruments_panel.h"
#include "material_panel.h"
#include "patient_monitor_panel.h"
#include "plots_panel.h"
#include "session_panel.h"

namespace vest::panels {
namespace {

QString g_pictures;                ///< folder; empty: none are kept
std::atomic<long> g_clock_set{0};  ///< s by which the system clock of this process was set

/// The system clock is set for as long as this lives.
struct ClockSet {
  explicit ClockSet(long seconds) { g_clock_set = seconds; }
  ~ClockSet() { g_clock_set = 0; }
};

/// A panel as rviz makes it, shown on Qt's offscreen platform.
template <class Panel>
struct Shown {
  Panel panel;
  Shown() {
    panel.initialize(nullptr);
    panel.resize(560, 240);
    panel.show();
  }
  void keep(const char* name) {
    if (!g_pictures.isEmpty()) panel.grab().save(g_pictures + "/" + name + ".png");
  }
  bool says(const QString& text) const {
    for (const QLabel* const label : panel.template findChildren<QLabel*>())
      if (label->text().contains(text)) return true;
    return false;
  }
};

template <class Message>
bool send(const std::string& topic, const Message& msg, const std::function<bool()>& done) {
  ros::Publisher publisher = ros::NodeHandle("/vest").advertise<Message>(topic, 2, true);
  publisher.publish(msg);
  return spin(done);
}

QPushButton* button(const QWidget& panel, const QString& text) {
  for (QPushButton* const b : panel.findChildren<QPushButton*>())
    if (b->text() == text) return b;
  return nullptr;
}

TEST(Session, ShowsTheStateAndPausesIt) {
  Shown<SessionPanel> shown;
  vest_msgs::SessionState state;
  state.state = vest_msgs::SessionState::RUNNING;
  state.scene = "gynaecology";
  state.step = 20024;
  state.real_time_factor = 0.999;
  state.recording = true;
  state.directory = "/tmp/session";
  state.recorded_bytes = 12000000;
  ASSERT_TRUE(send("session/state", state, [&] { return shown.says("20024"); }));
  EXPECT_TRUE(shown.says("running"));
  EXPECT_TRUE(shown.says("12.0 MB"));
  shown.keep("session");

  int asked = -1;
  ros::ServiceServer service =
      ros::NodeHandle("/vest").advertiseService<std_srvs::SetBool::Request, std_srvs::SetBool::Response>(
          "tissue/pause", [&](std_srvs::SetBool::Request& req, std_srvs::SetBool::Response& res) {
            asked = req.data;
            res.success = false;
            res.message = "a scene is loading";
            return true;
          });
  button(shown.panel, "Pause")->click();
  EXPECT_TRUE(spin([&] { return shown.says("a scene is loading"); }));
  EXPECT_EQ(asked, 1);
  EXPECT_FALSE(button(shown.panel, "Step")->isEnabled()) << "single steps are for a paused simulation";
}

TEST(Session, StartsAndStopsARecordingAndSetsTheSpeed) {
  Shown<SessionPanel> shown;
  ros::NodeHandle vest("/vest");
  std::vector<std::string> asked;
  const auto trigger = [&](const std::string& name) {
    return vest.advertiseService<std_srvs::Trigger::Request, std_srvs::Trigger::Response>(
        name, [&asked, name](std_srvs::Trigger::Request&, std_srvs::Trigger::Response& res) {
          asked.push_back(name);
          res.success = false;
          res.message = "refused: " + name;
          return true;
        });
  };
  const ros::ServiceServer start = trigger("session/start"), stop = trigger("session/stop");
  double speed = 0;
  const ros::ServiceServer pace =
      vest.advertiseService<vest_msgs::SetSpeed::Request, vest_msgs::SetSpeed::Response>(
          "tissue/speed", [&](vest_msgs::SetSpeed::Request& req, vest_msgs::SetSpeed::Response& res) {
            speed = req.speed;
            return res.success = true;
          });
  button(shown.panel, "Record")->click();
  EXPECT_TRUE(spin([&] { return shown.says("refused: session/start"); }));
  vest_msgs::SessionState state;
  state.recording = true;
  ASSERT_TRUE(send("session/state", state, [&] { return !button(shown.panel, "Record")->isEnabled(); }));
  button(shown.panel, "Stop")->click();
  EXPECT_TRUE(spin([&] { return shown.says("refused: session/stop"); }));
  EXPECT_EQ(asked, (std::vector<std::string>{"session/start", "session/stop"}));
  auto* const box = shown.panel.findChild<QDoubleSpinBox*>();
  box->setValue(0.5);
  Q_EMIT box->editingFinished();
  EXPECT_TRUE(spin([&] { return speed == 0.5; }));
}

TEST(Session, ARecorderThatEndsWithoutAWordIsTold) {
  Shown<SessionPanel> shown;
  ros::NodeHandle vest("/vest");
  ros::Publisher recorder = vest.advertise<vest_msgs::SessionState>("session/recording", 2, true);
  ros::Publisher simulation = vest.advertise<vest_msgs::SessionState>("session/state", 2, true);
  vest_msgs::SessionState state;
  state.recording = true;
  state.directory = "/tmp/killed";
  recorder.publish(state);
  simulation.publish(state);
  ASSERT_TRUE(spin([&] { return shown.says("recording to /tmp/killed"); }));
  EXPECT_TRUE(spin([&] { return shown.says("NOT RECORDED"); }));
  simulation.publish(state);
  spin([] { return false; }, 0.3);
  EXPECT_TRUE(shown.says("NOT RECORDED")) << "what the simulation says of it does not hide that";
  state.recording = false;  // begun again, and closed as it should be
  recorder.publish(state);
  simulation.publish(state);
  ASSERT_TRUE(spin([&] { return shown.says("not recording"); }));
  spin([] { return false; }, session::RecorderWatch::kSilent + 1);
  EXPECT_FALSE(shown.says("NOT RECORDED")) << "a recording that was closed is none that was lost";
}

TEST(Events, AreListedWithTimeInstrumentAndLoad) {
  EXPECT_EQ(eventWord(vest_msgs::TissueEvent::LIGATED), "ligated");
  EXPECT_EQ(eventWord(200), "kind 200");
  Shown<EventsPanel> shown;
  auto* const table = shown.panel.findChild<QTableWidget*>();
  ros::Publisher publisher =
      ros::NodeHandle("/vest").advertise<vest_msgs::TissueEvent>("tissue/events", 2000);
  ASSERT_TRUE(spin([&] { return publisher.getNumSubscribers() > 0; }));
  vest_msgs::TissueEvent event;
  event.step = 4012;
  event.kind = vest_msgs::TissueEvent::CUT;
  event.instrument = "right", event.object = "tube_left";
  event.force = 2.7;
  event.area = event.station = std::nan("");
  publisher.publish(event);
  ASSERT_TRUE(spin([&] { return table->rowCount() == 1; }));
  EXPECT_EQ(table->item(0, 0)->text(), "4.01");
  EXPECT_EQ(table->item(0, 1)->text(), "cut");
  EXPECT_EQ(table->item(0, 2)->text(), "tube_left");
  EXPECT_EQ(table->item(0, 3)->text(), "right");
  EXPECT_EQ(table->item(0, 4)->text(), "2.70 N");
  event.kind = vest_msgs::TissueEvent::COAGULATED;
  event.energy = 3.2, event.force = 0;
  for (int i = 0; i < EventsPanel::kMost + 100; ++i) {
    ++event.step;
    publisher.publish(event);
  }
  const QString last = QString::number(0.001 * static_cast<double>(event.step), 'f', 2);
  EXPECT_TRUE(spin([&] { return table->item(table->rowCount() - 1, 0)->text() == last; }));
  EXPECT_EQ(table->rowCount(), EventsPanel::kMost) << "a long session does not grow the list for ever";
  EXPECT_EQ(table->item(table->rowCount() - 1, 4)->text(), "3.2 J");
  shown.keep("events");
  event.step = 5;
  publisher.publish(event);
  EXPECT_TRUE(spin([&] { return table->rowCount() == 1; })) << "the simulation began anew";
}

TEST(Plots, ForceIsANumberABarAndALineAndScalesFitThemselves) {
  TimePlot plot("", {Qt::red, Qt::green}, 0.5);
  EXPECT_EQ(plot.top(), 0.5);
  plot.add(10, 0, 0.7);
  EXPECT_EQ(plot.top(), 1);
  plot.add(10.01, 0, 3.1);
  EXPECT_EQ(plot.points(0), 1u) << "points stand 50 ms apart";
  EXPECT_EQ(plot.top(), 5) << "and no peak between them is lost";
  plot.add(11, 1, std::nan(""));
  EXPECT_EQ(plot.points(1), 0u);
  for (double t = 11; t < 11 + 2 * TimePlot::kSpan; t += 0.1) plot.add(t, 0, 0.01);
  EXPECT_EQ(plot.top(), 0.5) << "what is out of sight counts no more";
  plot.add(2, 0, 0.2);
  EXPECT_EQ(plot.points(0), 1u) << "a bag was wound back";

  Shown<PlotsPanel> shown;
  shown.panel.resize(360, 420);
  ros::NodeHandle vest("/vest");
  ros::Publisher contacts = vest.advertise<vest_msgs::ContactModels>("tissue/contacts", 400);
  ros::Publisher instruments = vest.advertise<vest_msgs::InstrumentStates>("tissue/instruments", 400);
  ros::Publisher blood = vest.advertise<vest_msgs::HaemodynamicsState>("effects/haemodynamics", 400);
  ASSERT_TRUE(spin([&] {
    return contacts.getNumSubscribers() > 0 && instruments.getNumSubscribers() > 0 &&
           blood.getNumSubscribers() > 0;
  }));
  vest_msgs::ContactModels force;
  force.contacts.resize(1);
  force.contacts[0].instrument = "left";
  vest_msgs::InstrumentStates speed;
  speed.instruments.resize(1);
  speed.instruments[0].name = "right", speed.instruments[0].valid = true;
  vest_msgs::HaemodynamicsState loss;
  bool seen = false;
  auto* const bar = shown.panel.findChild<QProgressBar*>();
  for (int i = 0; i < 300; ++i) {
    const double t = 0.1 * i;
    force.header.stamp = speed.header.stamp = loss.header.stamp = ros::Time(100 + t);
    force.contacts[0].wrench.force.x = 1.5, force.contacts[0].wrench.force.z = 2.0;
    speed.instruments[0].twist.linear.y = 0.03 + 0.02 * std::sin(t);
    loss.blood_loss = 1e-6 * t;
    contacts.publish(force);
    instruments.publish(speed);
    blood.publish(loss);
    spin([] { return false; }, 0.01);
    seen = seen || (shown.says("2.50 N") && bar->value() == 250);
  }
  EXPECT_TRUE(seen) << "the left instrument's force as a number, and half of the bar";
  const QImage screen = shown.panel.grab().toImage();
  int blue = 0, orange = 0, red = 0;
  for (int y = 0; y < screen.height(); ++y)
    for (int x = 0; x < screen.width(); ++x) {
      const QColor c = screen.pixelColor(x, y);
      blue += c.blue() > 200 && c.red() < 130;
      orange += c.red() > 200 && c.green() > 120 && c.blue() < 110;
      red += c.red() > 200 && c.green() < 110;
    }
  EXPECT_GT(blue, 100) << "force of the left instrument";
  EXPECT_GT(orange, 100) << "speed of the right one";
  EXPECT_GT(red, 100) << "blood";
  shown.keep("plots");
  EXPECT_TRUE(spin([&] { return shown.says("– N"); })) << "a simulation that is gone has no force";
}

TEST(Session, WithoutASimulationSaysSoInsteadOfHanging) {
  Shown<SessionPanel> shown;
  button(shown.panel, "Reset")->click();
  EXPECT_TRUE(spin([&] { return shown.says("/vest/tissue/reset: nobody offers this service"); }));
}

TEST(Instruments, ShowsToolsAndExchangesThemOnlyWhenThePersonChooses) {
  Shown<InstrumentsPanel> shown;
  int exchanges = 0;
  vest_msgs::ExchangeTool::Request last;
  ros::ServiceServer service =
      ros::NodeHandle("/vest")
          .advertiseService<vest_msgs::ExchangeTool::Request, vest_msgs::ExchangeTool::Response>(
              "exchange_tool",
              [&](vest_msgs::ExchangeTool::Request& req, vest_msgs::ExchangeTool::Response& res) {
                ++exchanges;
                last = req;
                res.success = false;
                res.message = "it holds tissue: release it before the tool is exchanged";
                return true;
              });
  vest_msgs::InstrumentStates states;
  states.instruments.resize(2);
  states.instruments[0].name = "left";
  states.instruments[0].tool = vest_msgs::InstrumentState::TOOL_SCISSORS;
  states.instruments[0].source = vest_msgs::InstrumentState::SOURCE_CRTK;
  states.instruments[0].valid = true;
  states.instruments[0].functions = vest_msgs::InstrumentState::FUNCTION_CUT;
  states.instruments[1].name = "right";
  states.instruments[1].valid = false;
  ASSERT_TRUE(send("instruments", states, [&] { return shown.says("cut"); }));
  EXPECT_TRUE(shown.says("silent"));
  auto boxes = shown.panel.findChildren<QComboBox*>();
  ASSERT_GE(boxes.size(), 2);
  EXPECT_EQ(boxes[0]->currentText(), "scissors");
  EXPECT_EQ(boxes[1]->currentText(), "crtk");
  EXPECT_EQ(exchanges, 0) << "a message is not a wish";
  shown.keep("instruments");
  Q_EMIT boxes[0]->activated(vest_msgs::InstrumentState::TOOL_CLIP_APPLIER);
  EXPECT_TRUE(spin([&] { return shown.says("it holds tissue"); }));
  EXPECT_EQ(exchanges, 1);
  EXPECT_EQ(last.instrument, "left");
  EXPECT_EQ(last.tool, vest_msgs::InstrumentState::TOOL_CLIP_APPLIER);

  std::string command;
  ros::Subscriber sub = ros::NodeHandle("/vest").subscribe<vest_msgs::StringStamped>(
      "left/state_command", 2, [&](const vest_msgs::StringStampedConstPtr& msg) { command = msg->string; });
  ASSERT_TRUE(spin([&] { return sub.getNumPublishers() > 0; }));
  boxes[2]->setCurrentText("pause");
  EXPECT_TRUE(spin([&] {
    if (command.empty()) {
      boxes[2]->setCurrentText("pause");
      Q_EMIT boxes[2]->activated(boxes[2]->currentIndex());
    }
    return command == "pause";
  }));
}

TEST(Footswitches, LightWhilePressedAndGoOutWhenTheBoxFallsSilent) {
  Shown<FootswitchesPanel> shown;
  sensor_msgs::Joy joy;
  joy.buttons = {1, 0, 0, 1, 0, 0};
  const auto lit = [&](const char* name) {
    for (const QLabel* const label : shown.panel.findChildren<QLabel*>())
      if (label->text() == name) return !label->styleSheet().contains("#d8d8d8");
    return false;
  };
  ASSERT_TRUE(send("phantom_box/footswitches", joy, [&] { return lit("coag"); }));
  EXPECT_TRUE(lit("suction"));
  EXPECT_FALSE(lit("cut"));
  EXPECT_FALSE(lit("clutch"));
  shown.keep("footswitches");
  EXPECT_TRUE(spin([&] { return !lit("coag"); })) << "older than 100 ms counts as released";
  EXPECT_TRUE(shown.says("all count as released"));
}

TEST(PatientMonitor, DrawsTheCurveAndCountsInTheUnitsOfTheWard) {
  Shown<PatientMonitorPanel> shown;
  ros::Publisher publisher =
      ros::NodeHandle("/vest").advertise<vest_msgs::HaemodynamicsState>("effects/haemodynamics", 400);
  ASSERT_TRUE(spin([&] { return publisher.getNumSubscribers() > 0; }));
  vest_msgs::HaemodynamicsState msg;
  msg.heart_rate = 1.2;
  msg.systolic = 15999, msg.diastolic = 10666, msg.mean_pressure = 12443;  // 120/80 (93) mmHg
  msg.blood_loss = 42.5e-6;
  msg.loss_rate = 1e-6;  // of no vessel: a surface seeps
  msg.spo2 = 0.97f;
  for (int i = 0; i < 300; ++i) {
    const double t = 0.02 * i;
    msg.header.stamp = ros::Time(100 + t);
    msg.pressure = 13300 + 2600 * std::sin(2 * M_PI * 1.2 * t);
    msg.ecg = static_cast<float>(1e-3 * std::exp(-500 * std::pow(std::fmod(1.2 * t, 1.0) - 0.5, 2)));
    msg.pleth = static_cast<float>(0.02 * std::sin(2 * M_PI * 1.2 * t - 0.5));
    publisher.publish(msg);
    if (i % 20 == 0) spin([] { return false; }, 0.01);
  }
  EXPECT_TRUE(spin([&] { return shown.says("120/80"); }));
  EXPECT_TRUE(shown.says(">72<")) << "beats per minute";
  EXPECT_TRUE(shown.says(">42.5<")) << "ml";
  EXPECT_TRUE(shown.says("now 60 ml/min"));
  EXPECT_TRUE(shown.says(">97<")) << "%";
  const QImage screen = shown.panel.grab().toImage();
  int red = 0, green = 0, cyan = 0;
  for (int y = 0; y < screen.height(); ++y)
    for (int x = 0; x < screen.width() / 2; ++x) {
      const QColor c = screen.pixelColor(x, y);
      red += c.red() > 200 && c.green() < 120;
      green += c.green() > 200 && c.red() < 120 && c.blue() < 140;
      cyan += c.green() > 190 && c.blue() > 190 && c.red() < 120;
    }
  EXPECT_GT(red, 200) << "the pressure is drawn";
  EXPECT_GT(green, 100) << "the ECG is drawn";
  EXPECT_GT(cyan, 100) << "the plethysmogram is drawn";
  shown.keep("patient_monitor");
  msg.header.stamp = ros::Time(107), msg.spo2 = std::nanf("");
  publisher.publish(msg);
  EXPECT_TRUE(spin([&] { return shown.says(">?<"); })) << "no pulse, no number";
}

TEST(Haptics, SaysWhatTheLimiterDid) {
  EXPECT_EQ(limitWords(0), "");
  EXPECT_EQ(limitWords(2 | 16 | 32), "magnitude, stale, FAULT");
  Shown<HapticsPanel> shown;
  vest_msgs::HapticState state;
  state.device = "left_phantom";
  state.force_true.x = 3.0, state.force_true.y = 4.0;
  state.force_rendered.z = 3.3;
  state.model_age = 0.004;
  state.limits = 2;
  auto* const table = shown.panel.findChild<QTableWidget*>();
  ASSERT_TRUE(send("haptics/left/state", state, [&] { return table->rowCount() == 1; }));
  EXPECT_EQ(table->item(0, 2)->text(), "5.00");
  EXPECT_EQ(table->item(0, 3)->text(), "3.30");
  EXPECT_EQ(table->item(0, 4)->text(), "4.0");
  EXPECT_EQ(table->item(0, 7)->text(), "magnitude");
  shown.keep("haptics");
}

TEST(Haptics, TwoDevicesOfOneModelAreTwoRows) {
  Shown<HapticsPanel> shown;
  auto* const table = shown.panel.findChild<QTableWidget*>();
  vest_msgs::HapticState state;
  state.device = "simulated";
  ros::Publisher publishers[2];
  const char* const names[] = {"left", "right"};
  for (int i = 0; i < 2; ++i) {
    state.instrument = names[i];
    publishers[i] = ros::NodeHandle("/vest").advertise<vest_msgs::HapticState>(
        std::string("haptics/two_") + names[i] + "/state", 2, true);
    publishers[i].publish(state);
  }
  EXPECT_TRUE(spin([&] { return table->rowCount() == 2; }));
  std::vector<QString> instruments;
  for (int row = 0; row < table->rowCount(); ++row) instruments.push_back(table->item(row, 1)->text());
  std::sort(instruments.begin(), instruments.end());
  EXPECT_EQ(instruments, (std::vector<QString>{"left", "right"}));
}

// Set back by an hour, a silence judged by the system clock would be seen an hour later; set forward, all
// would count as silent at once.
TEST(AllPanels, SilenceIsSeenThoughTheSystemClockIsSetBack) {
  Shown<FootswitchesPanel> switches;
  Shown<SessionPanel> session;
  Shown<PatientMonitorPanel> monitor;
  Shown<HapticsPanel> haptics;
  sensor_msgs::Joy joy;
  joy.buttons = {1, 0, 0, 0, 0, 0};
  vest_msgs::SessionState state;
  state.step = 4711;
  vest_msgs::HaemodynamicsState blood;
  blood.heart_rate = 1.2;
  vest_msgs::HapticState force;
  force.device = "silent";
  auto* const table = haptics.panel.findChild<QTableWidget*>();
  ASSERT_TRUE(send("haptics/clock/state", force, [&] { return table->rowCount() == 1; }));
  ASSERT_TRUE(send("session/state", state, [&] { return session.says("4711"); }));
  ASSERT_TRUE(send("effects/haemodynamics", blood, [&] { return monitor.says(">72<"); }));
  ASSERT_TRUE(send("phantom_box/footswitches", joy, [&] { return !switches.says("no footswitches heard"); }));
  const ros::WallTime before = ros::WallTime::now();
  const ClockSet back(-3600);
  ASSERT_LT(ros::WallTime::now(), before) << "the clock was not set at all";
  EXPECT_TRUE(spin([&] { return switches.says("all count as released"); }));
  EXPECT_TRUE(spin([&] { return session.says("no word from the simulation"); }));
  EXPECT_TRUE(spin([&] { return monitor.says("no data"); }));
  EXPECT_TRUE(spin([&] { return table->item(0, 7)->text() == "silent"; }));
}

TEST(Material, SendsTheEditOfTheObjectThatIsChosen) {
  Shown<MaterialPanel> shown;
  vest_msgs::ParameterEdit edit;
  ros::Subscriber sub = ros::NodeHandle("/vest").subscribe<vest_msgs::ParameterEdit>(
      "parameter_edit", 2, [&](const vest_msgs::ParameterEditConstPtr& msg) { edit = *msg; });
  vest_msgs::TissueTopology topology;
  topology.scene_hash = "1";
  topology.objects.resize(2);
  topology.objects[0].name = "uterus", topology.objects[0].organ = "uterus",
  topology.objects[0].knot_count = 359;
  topology.objects[1].name = "cavity", topology.objects[1].model = vest_msgs::TissueObject::MODEL_RIGID;
  ASSERT_TRUE(send("tissue/topology", topology, [&] { return shown.says("359 knots"); }));
  ASSERT_TRUE(spin([&] { return sub.getNumPublishers() > 0; }));
  auto boxes = shown.panel.findChildren<QComboBox*>();
  EXPECT_EQ(boxes[0]->findText("cavity"), -1) << "what does not move has no material to change";
  boxes[0]->setCurrentText("uterus");
  boxes[1]->setCurrentText("youngs_modulus");
  shown.panel.findChild<QDoubleSpinBox*>()->setValue(25000.0);
  button(shown.panel, "Apply")->click();
  ASSERT_TRUE(spin([&] { return !edit.parameter.empty(); }));
  EXPECT_EQ(edit.object, "uterus");
  EXPECT_EQ(edit.parameter, "youngs_modulus");
  EXPECT_EQ(edit.value, 25000.0);
  shown.keep("material");
}

TEST(AllPanels, KeepTheirNamespaceAndSurviveAHundredLives) {
  for (int i = 0; i < 100; ++i) {
    Shown<SessionPanel> a;
    Shown<InstrumentsPanel> b;
    Shown<PatientMonitorPanel> c;
    QApplication::processEvents();
  }
  SessionPanel panel;
  rviz::Config config;
  config.mapSetValue("Namespace", "/second");
  panel.load(config);
  rviz::Config saved;
  panel.save(saved);
  QString name;
  ASSERT_TRUE(saved.mapGetString("Namespace", &name));
  EXPECT_EQ(name, "/second");
}

TEST(AllPanels, ShowTheSessionOfRvizsOwnNamespace) {
  EXPECT_EQ(sessionNamespace("/left"), "/left");
  EXPECT_EQ(sessionNamespace("/"), "/vest") << "rviz started by hand";
  SessionPanel panel;
  rviz::Config saved;
  panel.save(saved);
  QString name;
  EXPECT_FALSE(saved.mapGetString("Namespace", &name)) << "a configuration saved here serves any namespace";
  const QDir folder(QString::fromStdString(ros::package::getPath("vest_viz") + "/rviz"));
  for (const QString& file : folder.entryList({"*.rviz"})) {
    rviz::YamlConfigReader reader;
    rviz::Config shipped;
    reader.readFile(shipped, folder.filePath(file));
    ASSERT_FALSE(reader.error()) << file.toStdString();
    const rviz::Config panels = shipped.mapGetChild("Panels");
    for (int i = 0; i < panels.listLength(); ++i)
      EXPECT_FALSE(panels.listChildAt(i).mapGetString("Namespace", &name)) << file.toStdString();
  }
}

}  // namespace
}  // namespace vest::panels

#include "exercise_panels.h"

// In front of the C library's: the tests set the system clock without harm to anybody else.
extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const int result = static_cast<int>(::syscall(SYS_clock_gettime, clock, time));
  if (result == 0 && clock == CLOCK_REALTIME) time->tv_sec += vest::panels::g_clock_set;
  return result;
}

int main(int argc, char** argv) {
  qputenv("QT_QPA_PLATFORM", "offscreen");
  ros::init(argc, argv, "vest_viz_test_panels");
  QApplication application(argc, argv);
  testing::InitGoogleTest(&argc, argv);
  // Pictures for the documentation: rosrun vest_viz vest_viz_test_panels --pictures=FOLDER
  for (int i = 1; i < argc; ++i)
    if (QString(argv[i]).startsWith("--pictures=")) vest::panels::g_pictures = QString(argv[i]).mid(11);
  ros::NodeHandle keep;
  return RUN_ALL_TESTS();
}
