#pragma once

#include <vector>

#include "vest_tissue/modelling/ring_net.h"

/// How thick the links of a ring net must be, so that a bar that is cut from it has its tissue's modulus.
///
/// Each piece of the wall between two rings is stretched along its meridians, free to narrow and to shear;
/// what its links then store is W = ½ E eps² V (the strain energy of a bar; so springs are given moduli in
/// Lloyd, Székely & Harders 2007, IEEE Trans. Vis. Comput. Graph. 13(5):1081). Shares of a section alone
/// cannot do it: a diagonal turns its rings and carries next to nothing, and sheets have other links than
/// tubes.
namespace vest::modelling {

/// Of each piece between ring r and r+1: Young's modulus along the meridians over that of the links'
/// material. Links to poles do not count.
/// @param areas m², of each link
std::vector<double> axialModuli(const RingNet& net, const std::vector<NetLink>& links,
                                const std::vector<double>& areas);

/// Areas of the links, m², so that each piece has the modulus of its material. They begin as assumed shares
/// of the wall's section; what belongs to a piece is scaled by one factor.
std::vector<double> linkAreas(const RingNet& net, const std::vector<NetLink>& links);

}  // namespace vest::modelling
