#include "vest_tissue/scene/request.h"

#include <cmath>
#include <cstdio>
#include <locale>
#include <sstream>
#include <stdexcept>

namespace vest::scene {

std::string requestText(const TopologyRequest& request, const Description& description) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(17);
  if (request.kind == TopologyRequest::Kind::RemoveClip)
    return "remove_clip " + std::to_string(request.element);
  const bool remove = request.kind == TopologyRequest::Kind::RemoveLink;
  const std::string name =
      request.object < description.objects.size() ? description.objects[request.object].name : "?";
  out << (remove ? "remove_link " : "split_knot ") << name << ' ' << request.element;
  if (!remove) out << ' ' << request.normal.x() << ' ' << request.normal.y() << ' ' << request.normal.z();
  return out.str();
}

TopologyRequest parseRequest(const std::string& text, const Description& description) {
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument(
        "request '" + text + "': " + what +
        " (allowed: remove_link OBJECT LINK, split_knot OBJECT KNOT NX NY NZ, remove_clip ID)");
  };
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  std::string verb, object, rest;
  TopologyRequest request;
  in >> verb;
  if (verb == "remove_clip") {
    request.kind = TopologyRequest::Kind::RemoveClip;
    if (!(in >> request.element)) refuse("has no id");
    if (in >> rest) refuse("goes on with '" + rest + "'");
    return request;
  }
  if (!(in >> object >> request.element)) refuse("is cut off");
  if (verb != "remove_link" && verb != "split_knot") refuse("'" + verb + "' is not known");
  std::size_t index = 0;
  while (index < description.objects.size() && description.objects[index].name != object) ++index;
  if (index == description.objects.size()) refuse("the scene has no object '" + object + "'");
  request.object = static_cast<std::uint16_t>(index);
  if (verb == "split_knot") {
    request.kind = TopologyRequest::Kind::SplitKnot;
    if (!(in >> request.normal.x() >> request.normal.y() >> request.normal.z())) refuse("has no normal");
    if (!(request.normal.squaredNorm() > 0.0) || !request.normal.allFinite())
      refuse("its normal has no direction");
  }
  if (in >> rest) refuse("goes on with '" + rest + "'");
  return request;
}

}  // namespace vest::scene
