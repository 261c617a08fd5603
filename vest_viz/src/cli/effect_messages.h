#pragma once

#include <set>
#include <string>

#include <vest_msgs/FluidState.h>
#include <vest_msgs/GasState.h>
#include <vest_msgs/HaemodynamicsState.h>
#include <vest_msgs/LensState.h>
#include <vest_msgs/SmokeState.h>
#include <vest_msgs/SutureStates.h>
#include <vest_msgs/TissueAttachments.h>
#include <vest_msgs/TissueState.h>
#include <vest_msgs/TissueTopology.h>

#include "vest_tissue/scene/world.h"

/// Made-up effects for looking at the displays, for tests and for the benchmark: shapes and amounts by eye,
/// no simulation. They lie on the organs of the gynaecology scene; other scenes get those whose organs they
/// have.
namespace vest::tools {

/// Words: fields, cut, clips, sutures, fluid, smoke, lens, monitor.
/// @throws std::invalid_argument naming the word and what is allowed
std::set<std::string> effectWords(const std::string& separated_by_commas);

/// A place of the scene: the knot of an object nearest to a point, with the direction away from the object's
/// middle. False if there is no such object.
bool placeOn(const vest::scene::Description& scene, const std::string& object, const Eigen::Vector3d& near,
             Eigen::Vector3d* place, Eigen::Vector3d* out);

/// Bleeding, coagulated, charred and bloodless spots that grow until t = 4 s.
void addFields(const vest::scene::Description& scene, double t, vest_msgs::TissueState* state);
/// Turns a strip of the uterus into a cut face.
void addCut(vest_msgs::TissueTopology* topology);
vest_msgs::TissueAttachments attachmentsAt(const vest::scene::Description& scene);
vest_msgs::SutureStates suturesAt(const vest::scene::Description& scene, double t);
vest_msgs::FluidState fluidAt(const vest::scene::Description& scene, double t);
vest_msgs::SmokeState smokeAt(const vest::scene::Description& scene, double t);
/// @param fog 0 … 1
vest_msgs::LensState lensAt(double fog);
vest_msgs::HaemodynamicsState haemodynamicsAt(double t);
vest_msgs::GasState gasAt();

}  // namespace vest::tools
