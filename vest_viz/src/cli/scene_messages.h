#pragma once

#include <vest_msgs/InstrumentState.h>
#include <vest_msgs/TissueTopology.h>
#include <Eigen/Core>

#include "vest_tissue/scene/world.h"

namespace vest::tools {

enum class Place { Left, Right, Endoscope };

/// Instrument of the trainer box with its tip at a place (m, world), by inverse kinematics through the
/// trocar.
/// @param roll, jaw rad
vest_msgs::InstrumentState instrumentAt(Place place, const Eigen::Vector3d& tip, double roll, double jaw);
/// Tip of the endoscope pushed in by `insertion` m, aimed at the uterus.
Eigen::Vector3d endoscopeTip(double insertion);
/// The topology message that the simulation would publish for a scene.
vest_msgs::TissueTopology topologyOf(const scene::Description& scene);

/// A chessboard in the plane z = 0, its middle at the origin: `columns` × `rows` squares of `square` metres,
/// as two rigid objects (organs board_white and board_black) with a white margin.
vest_msgs::TissueTopology chessboard(int columns, int rows, double square);

}  // namespace vest::tools
