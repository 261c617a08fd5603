#pragma once

#include <functional>
#include <future>
#include <memory>

#include <rviz/display.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/SessionState.h>
#include <QImage>
#include <QPointer>
#include <opencv2/core.hpp>

#include "endoscope_inputs.h"
#include "endoscope_pipeline.h"
#include "instrument_history.h"
#include "teacher_drawing.h"
#include "tissue_input.h"
#include "truth_output.h"
#include "vest_viz/session/recorder_watch.h"
#include "worker.h"

namespace rviz {
class BoolProperty;
class EnumProperty;
class FloatProperty;
class IntProperty;
class PanelDockWidget;
class RenderPanel;
class RosTopicProperty;
class StringProperty;
class TfFrameProperty;
}  // namespace rviz

namespace vest::displays {

class ExerciseRim;
class ImagePane;

/// vest_viz/EndoscopicView: what the camera at the endoscope's tip sees, in a pane (or over rviz's whole
/// view) and as endoscope/image_raw, camera_info and image_raw/compressed.
class EndoscopicViewDisplay : public rviz::Display {
  Q_OBJECT
 public:
  EndoscopicViewDisplay();
  ~EndoscopicViewDisplay() override;
  void update(float wall_dt, float ros_dt) override;
  void reset() override;

 protected:
  void onInitialize() override;
  void onEnable() override;
  void onDisable() override;

 private Q_SLOTS:
  void updateTopics();
  void updateCamera();
  void updatePlace();
  void updateScene();
  void updateLook();
  void updatePen();

 private:
  /// All of the instruments topic, while no simulation sends those of its states.
  void subscribeInstruments();
  bool endoscopePose(Eigen::Isometry3d* X_WO, std::string* how);
  /// Who gets a picture, and what with it: settled before a worker finishes it.
  struct Outgoing {
    ros::Publisher image, compressed;  ///< invalid: nobody listens, or not this time
    std_msgs::Header header;
  };
  Outgoing outgoing(const ros::Time& stamp);
  static void send(const Outgoing& to, const cv::Mat& picture);
  /// What a worker made of a rendering. Times in s.
  struct Finished {
    double finish = 0, send = 0, show = 0;
    QImage image;
  };
  Finished finish(const Outgoing& to);
  /// Shows what the worker has finished, and waits for it if it has not.
  void collect();
  /// The same where nobody could handle its error.
  void waitForWorker();
  void account(double now);

  rviz::StringProperty* tissue_topic_;
  rviz::RosTopicProperty* instruments_topic_;
  rviz::StringProperty* image_topic_;
  rviz::TfFrameProperty* optical_frame_;
  rviz::IntProperty* width_;
  rviz::IntProperty* height_;
  rviz::FloatProperty* field_of_view_;
  rviz::FloatProperty* k1_;
  rviz::StringProperty* calibration_;
  rviz::FloatProperty* k2_;
  rviz::FloatProperty* circle_;
  rviz::FloatProperty* rate_;
  rviz::FloatProperty* compressed_rate_;
  rviz::EnumProperty* quality_;
  rviz::EnumProperty* smoke_;
  rviz::StringProperty* effects_topic_;
  rviz::StringProperty* session_topic_;
  rviz::FloatProperty* lamp_;
  rviz::FloatProperty* white_;
  rviz::FloatProperty* noise_;
  rviz::FloatProperty* focus_;
  rviz::BoolProperty* fill_;
  rviz::EnumProperty* pen_;
  rviz::BoolProperty* print_timing_;

  TissueInput input_;
  EndoscopeInputs effects_;
  TruthOutput truth_;
  /// All that the instruments topic has; and what the simulation sends of it with each state, which is enough
  /// and a sixteenth of the messages.
  ros::Subscriber instruments_sub_, state_instruments_sub_, session_sub_;
  InstrumentHistory history_;
  void tellExercise(const std::function<bool(ExerciseRim&)>& change);
  ros::Subscriber recorder_sub_, instruction_sub_, score_sub_, notes_sub_;
  TeacherDrawing drawing_;
  session::RecorderWatch recorder_;
  vest_msgs::InstrumentStates::ConstPtr instruments_;  ///< of the picture
  bool begun_ = false;
  ros::Publisher image_pub_, info_pub_, compressed_pub_;
  std::unique_ptr<EndoscopePipeline> view_;
  camera::Intrinsics camera_;
  // rviz deletes its view, and what lies over it, before the displays.
  QPointer<ImagePane> pane_;
  QPointer<rviz::PanelDockWidget> dock_;
  QPointer<rviz::RenderPanel> covered_;  ///< the view under the pane, which is not drawn
  cv::Mat picture_;                      ///< the worker's, while there is one
  std::future<Finished> finishing_;
  /// Of picture::kResolutions: coarse at first, moved by the frame time when the quality is automatic.
  std::size_t level_ = 2;
  double first_picture_ = 0;  ///< s, steady clock: when drawing began
  double last_picture_ = 0, next_picture_ = 0, last_compressed_ = 0, last_account_ = 0, looked_ = 0;
  double last_state_ = 0;        ///< s, when the newest state was taken
  double waiting_since_ = 0;     ///< s, for instruments of a state; 0: not
  bool tissue_changed_ = false;  ///< since the last picture
  ros::Time last_stamp_;
  struct Sums {
    double tissue = 0, draw = 0, read = 0, finish = 0, send = 0, show = 0;
    int pictures = 0;
  } sums_;
  Worker worker_;  ///< last: its task uses all of the above
};

}  // namespace vest::displays
