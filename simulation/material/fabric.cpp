#include "simulation/material/fabric.h"

#include <array>
#include <cmath>
#include <vector>

#include "core/error.h"

namespace atelier {
namespace {

const std::array<Fabric, 10>& fabrics() {
  // density kg/m2, warp, weft, shear N/m, bending N m, damping s, friction, thickness m
  static const std::array<Fabric, 10> table = {{
      {"silk",
       "light plain silk; bending D",
       {"silk", 0.06, 1500, 1200, 15, 9.0e-7, 0.0005, 0.25, 0.0002},
       20,
       40},
      {"cotton",
       "plain-woven cotton; density and thickness P, bending D",
       {"cotton", 0.1503, 1500, 1200, 60, 1.57e-5, 0.0005, 0.4, 0.000318},
       60,
       76},
      {"wool",
       "wool suiting; density and thickness P, bending D",
       {"wool", 0.2348, 1000, 800, 40, 1.5e-5, 0.0005, 0.4, 0.000568},
       40,
       70},
      {"denim",
       "11 oz denim, 99 % cotton; density, stretching and bending W, shear and thickness K",
       {"denim", 0.324, 1060, 232, 120, 7.9e-5, 0.0005, 0.5, 0.001},
       70,
       90},
      {"leather",
       "sheep garment leather; thickness M, bending D",
       {"leather", 0.5, 3000, 3000, 1200, 4.0e-5, 0.0005, 0.5, 0.0008},
       47,
       70},
      {"jersey",
       "interlock of a t-shirt, 60 % cotton; density, stretching, shear and bending W",
       {"jersey", 0.187, 414, 140, 44, 2.1e-5, 0.0005, 0.4, 0.0008}},
      {"rib-knit",
       "underwear, 95 % cotton, 5 % spandex; density, stretching, shear and bending W",
       {"rib-knit", 0.276, 255, 106, 83, 3.6e-5, 0.0005, 0.4, 0.001}},
      {"ponte",
       "double knit of a jacket, polyester and rayon; density, stretching, shear and bending W",
       {"ponte", 0.284, 269, 144, 45, 3.6e-5, 0.0005, 0.4, 0.001}},
      {"satin",
       "polyester weave of a tablecloth; density, stretching, shear and bending W",
       {"satin", 0.128, 2172, 2108, 101, 4.1e-5, 0.0005, 0.3, 0.0003}},
      {"microfibre",
       "light polyester of a jacket; density, stretching, shear and bending W",
       {"microfibre", 0.113, 405, 227, 63, 1.9e-5, 0.0005, 0.3, 0.0003}},
  }};
  return table;
}

/// Median and spread of what is normal in its logarithm.
void fit_logarithms(const std::vector<double>& values, double& median, double& spread) {
  const auto count = static_cast<double>(values.size());
  double mean = 0;
  for (const double value : values) {
    mean += std::log(value) / count;
  }
  double variance = 0;
  for (const double value : values) {
    variance += std::pow(std::log(value) - mean, 2) / (count - 1);
  }
  median = std::exp(mean);
  spread = std::sqrt(variance);
}

}  // namespace

std::span<const Fabric> all_fabrics() {
  return fabrics();
}

std::vector<std::string> fabric_names() {
  std::vector<std::string> names{"custom"};
  for (const Fabric& fabric : all_fabrics()) {
    names.emplace_back(fabric.name);
  }
  return names;
}

Material fabric_material(std::string_view name) {
  for (const Fabric& fabric : all_fabrics()) {
    if (fabric.name == name) {
      return fabric.material;
    }
  }
  throw LogicError("no fabric is called '" + std::string(name) + "'");
}

StiffnessPrior stiffness_prior() {
  std::vector<double> stretch;
  std::vector<double> bending;
  for (const Fabric& fabric : all_fabrics()) {
    stretch.push_back(std::sqrt(fabric.material.stretch_warp * fabric.material.stretch_weft));
    bending.push_back(fabric.material.bending);
  }
  StiffnessPrior usual;
  fit_logarithms(stretch, usual.stretch, usual.stretch_spread);
  fit_logarithms(bending, usual.bending, usual.bending_spread);
  return usual;
}

}  // namespace atelier
