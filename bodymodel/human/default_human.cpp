#include "bodymodel/human/default_human.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "bodymodel/human/human_rig.h"
#include "bodymodel/human/human_surface.h"
#include "bodymodel/human/human_uv.h"
#include "core/error.h"

namespace atelier {
namespace {

struct Parameter {
  const char* name;
  const char* unit;
  const char* help;
  double DefaultHumanOptions::*option;
  double BodyMeasurements::*measure;
  double HumanBuild::*factor;  ///< what is solved for
  double female, male;         ///< average
  double residual;             ///< standard deviation at given stature and mass, as a share
  double by_stature;           ///< exponent of stature over average stature
  double by_volume;            ///< exponent of the body's volume in this measure alone
  double by_bulk;              ///< exponent of girth: sqrt(relative mass / relative stature)
  double low, high;            ///< allowed, metres or kilograms
};

// Averages start from ANSUR II (Gordon et al. 2014), rounded, for people lighter than its soldiers,
// with girths that belong to the mass. Exponents and spreads are our choice: girths grow with the
// bulk of the section, the waist faster, the neck slower.
const Parameter kParameters[] = {
    {"stature", "m", "stature, from the lowest to the highest point", &DefaultHumanOptions::stature,
     &BodyMeasurements::stature, &HumanBuild::neck_length, 1.63, 1.755, 0.038, 0, 0, 0, 1.40, 2.15},
    {"mass", "kg", "mass, the volume times 1010 kg/m^3", &DefaultHumanOptions::mass,
     &BodyMeasurements::mass, &HumanBuild::fullness, 61.5, 78, 0.13, 2, 0, 0, 35, 180},
    {"leg_length", "m", "leg length, from the ground to the crotch",
     &DefaultHumanOptions::leg_length, &BodyMeasurements::leg_length, &HumanBuild::leg, 0.767,
     0.825, 0.022, 1.1, 0.35, 0, 0.6, 1.1},
    {"torso_length", "m", "torso length, from the crotch to the neck joint",
     &DefaultHumanOptions::torso_length, &BodyMeasurements::torso_length, &HumanBuild::torso, 0.598,
     0.645, 0.008, 0.9, 0.4, 0, 0.4, 0.85},
    {"arm_length", "m", "arm length, from the acromion to the wrist",
     &DefaultHumanOptions::arm_length, &BodyMeasurements::arm_length, &HumanBuild::arm, 0.53, 0.575,
     0.028, 1, 0.1, 0, 0.4, 0.8},
    {"shoulder_breadth", "m", "shoulder breadth, between the acromia",
     &DefaultHumanOptions::shoulder_breadth, &BodyMeasurements::shoulder_breadth,
     &HumanBuild::shoulder, 0.365, 0.42, 0.032, 0.6, 0.05, 0.15, 0.28, 0.52},
    {"neck_girth", "m", "neck girth, half way up", &DefaultHumanOptions::neck_girth,
     &BodyMeasurements::neck_girth, &HumanBuild::neck, 0.32, 0.39, 0.035, 0, 0.04, 0.7, 0.25, 0.55},
    {"chest_girth", "m", "chest girth at the bust", &DefaultHumanOptions::chest_girth,
     &BodyMeasurements::chest_girth, &HumanBuild::chest, 0.91, 1.01, 0.026, -0.1, 0.4, 1.15, 0.65,
     1.6},
    {"waist_girth", "m", "waist girth at the natural waist", &DefaultHumanOptions::waist_girth,
     &BodyMeasurements::waist_girth, &HumanBuild::waist, 0.755, 0.875, 0.036, -0.1, 0.4, 1.55, 0.5,
     1.6},
    {"hip_girth", "m", "hip girth at the hip joints", &DefaultHumanOptions::hip_girth,
     &BodyMeasurements::hip_girth, &HumanBuild::hip, 1.015, 1.02, 0.022, -0.1, 0.45, 1.12, 0.7,
     1.7},
    {"thigh_girth", "m", "girth of the upper thigh", &DefaultHumanOptions::thigh_girth,
     &BodyMeasurements::thigh_girth, &HumanBuild::thigh, 0.595, 0.6, 0.03, -0.1, 0.35, 1.15, 0.35,
     1.0},
    {"upper_arm_girth", "m", "girth of the relaxed upper arm",
     &DefaultHumanOptions::upper_arm_girth, &BodyMeasurements::upper_arm_girth,
     &HumanBuild::upper_arm, 0.275, 0.318, 0.035, -0.1, 0.1, 1.2, 0.18, 0.6}};
constexpr std::size_t kCount = std::size(kParameters);

// A body's half with everything that does not change with its shape.
struct Maker {
  HumanTemplate half = human_template();
  HumanCoordinates coordinates = human_coordinates(half);
  Triangles faces;

  Maker() {
    const int middle = half.middle;
    const int shift = static_cast<int>(half.points.size()) - middle;
    const Index n = static_cast<Index>(half.faces.size());
    faces.resize(2 * n, 3);
    const auto right = [&](int v) { return v < middle ? v : v + shift; };
    for (Index f = 0; f < n; ++f) {
      const auto& face = half.faces[static_cast<std::size_t>(f)];
      faces.row(f) << face[0], face[1], face[2];
      faces.row(n + f) << right(face[0]), right(face[2]), right(face[1]);
    }
  }

  Points vertices(const HumanAnatomy& anatomy) const {
    const std::vector<Vec3d> left = human_surface(half, coordinates, anatomy);
    const Index middle = half.middle;
    const Index n = static_cast<Index>(left.size());
    Points points(2 * n - middle, 3);
    for (Index i = 0; i < n; ++i) {
      const Vec3d& p = left[static_cast<std::size_t>(i)];
      points.row(i) << p.x, p.y, p.z;
      if (i >= middle) {
        points.row(n - middle + i) << -p.x, p.y, p.z;
      }
    }
    return points;
  }

  BodyMeasurements measure(const HumanBuild& build) const {
    const HumanAnatomy anatomy = human_anatomy(build);
    Mesh mesh;
    mesh.vertices = vertices(anatomy);
    mesh.faces = faces;
    return measure_body(mesh, human_skeleton(anatomy));
  }
};

using Vector = Eigen::Matrix<double, kCount, 1>;
using Matrix = Eigen::Matrix<double, kCount, kCount>;

Vector log_measures(const BodyMeasurements& m) {
  Vector v;
  for (std::size_t i = 0; i < kCount; ++i) {
    v[static_cast<Index>(i)] = std::log(m.*kParameters[i].measure);
  }
  return v;
}

void scale(HumanBuild& build, const Vector& log_factors) {
  for (std::size_t i = 0; i < kCount; ++i) {
    build.*kParameters[i].factor *= std::exp(log_factors[static_cast<Index>(i)]);
  }
}

// d log measure / d log factor, by central differences, or one-sided ones where `here` is known.
Matrix measure_jacobian(const Maker& maker, const HumanBuild& build, const Vector* here = nullptr) {
  Matrix jacobian;
  const double h = 0.004;
  for (std::size_t i = 0; i < kCount; ++i) {
    HumanBuild more = build;
    more.*kParameters[i].factor *= std::exp(h);
    const Vector above = log_measures(maker.measure(more));
    if (here != nullptr) {
      jacobian.col(static_cast<Index>(i)) = (above - *here) / h;
      continue;
    }
    HumanBuild less = build;
    less.*kParameters[i].factor *= std::exp(-h);
    jacobian.col(static_cast<Index>(i)) = (above - log_measures(maker.measure(less))) / (2 * h);
  }
  return jacobian;
}

struct Solved {
  HumanBuild build;
  Matrix jacobian;  ///< near the solution
};

std::string with_unit(double value, const char* unit) {
  char text[40];
  std::snprintf(text, sizeof text, "%.3g %s", value, unit);
  return text;
}

// Half-widths where no girth is given follow the rest of the mass, thinner or thicker by at most
// these factors: bodies between the 0.1st and 99.9th percentiles need no more.
constexpr double kMinFullness = 0.70;
constexpr double kMaxFullness = 1.45;

// Newton on the logarithms, with steps held back and one Jacobian for several steps. `likely` is
// the mass that the girths speak for, for the message.
Solved solve_build(const Maker& maker, const DefaultHumanOptions& options,
                   const BodyMeasurements& wanted, double likely) {
  Solved solved;
  solved.build.male = options.male;
  solved.build.stature = wanted.stature;
  const Vector target = log_measures(wanted);
  Vector gap = target - log_measures(maker.measure(solved.build));
  double before = 1e9;
  double best = 1e9;
  int best_step = 0;
  for (int step = 0; step < 24 && step < best_step + 5; ++step) {
    const double largest_gap = gap.cwiseAbs().maxCoeff();
    if (largest_gap < 0.2 * kHumanMeasureError) {
      break;
    }
    if (largest_gap < 0.9 * best) {
      best = largest_gap;
      best_step = step;
    }
    if (step == 0 || largest_gap > 0.3 * before) {
      const Vector here = target - gap;
      solved.jacobian = measure_jacobian(maker, solved.build, &here);
    }
    before = largest_gap;
    Vector move = solved.jacobian.partialPivLu().solve(gap);
    const double largest = move.cwiseAbs().maxCoeff();
    if (largest > 0.2) {
      move *= 0.2 / largest;
    }
    scale(solved.build, move);
    for (const Parameter& p : kParameters) {
      double& factor = solved.build.*p.factor;
      factor = std::clamp(factor, 0.4, 2.5);
    }
    gap = target - log_measures(maker.measure(solved.build));
  }
  Index worst = 0;
  const double error = gap.cwiseAbs().maxCoeff(&worst);
  const double fullness = solved.build.fullness;
  const bool full = fullness >= kMinFullness && fullness <= kMaxFullness;
  const bool plausible = solved.build.neck_length > 0.45 && full;
  if (!(error <= kHumanMeasureError) || !plausible) {
    if (!plausible) {
      worst = full ? 0 : 1;
    }
    const Parameter& p = kParameters[worst];
    std::string together;
    bool girths = false;
    for (const Parameter& q : kParameters) {
      if (&q != &p && options.*q.option > 0) {
        together += (together.empty() ? "" : ", ") + std::string(q.name) + " " +
                    with_unit(wanted.*q.measure, q.unit);
        girths = girths || q.by_bulk > 0;
      }
    }
    throw DataError(
        "", p.name,
        "no body has " + with_unit(wanted.*p.measure, p.unit) + " together with " +
            (together.empty() ? "the averages of the rest" : together) +
            (girths ? "; the girths that are given speak for " + with_unit(likely, "kg") : ""),
        "measures of one person, or none, which lets them follow from sex, stature and mass");
  }
  return solved;
}

double between(double female, double male, double share) {
  return female + share * (male - female);
}

void check_human_options(const DefaultHumanOptions& options) {
  const std::string problem = human_options_problem(options);
  ATELIER_CHECK(problem.empty(), "default human: " + problem);
}

// Measures that no adult has: refused before the solver bends a body to them.
void check_plausible(const DefaultHumanOptions& options, const BodyMeasurements& wanted) {
  const double index = wanted.mass / (wanted.stature * wanted.stature);
  if (!(index >= kMinMassIndex && index <= kMaxMassIndex)) {
    throw DataError("", "mass",
                    with_unit(wanted.mass, "kg") + " at a stature of " +
                        with_unit(wanted.stature, "m") + ": a body mass index of " +
                        with_unit(index, "kg/m^2"),
                    with_unit(kMinMassIndex, "") + "to " + with_unit(kMaxMassIndex, "kg/m^2"));
  }
  DefaultHumanOptions others = options;
  for (const Parameter& p : kParameters) {
    if (p.by_bulk > 0) {
      others.*p.option = 0;
    }
  }
  others.stature = wanted.stature;
  others.mass = wanted.mass;
  const BodyMeasurements usual = expected_measures(others);
  for (const Parameter& p : kParameters) {
    const double spread = kPlausibleSpreads * p.residual;
    const double expected = usual.*p.measure;
    if (p.by_bulk > 0 && std::abs(std::log(wanted.*p.measure / expected)) > spread) {
      throw DataError("", p.name,
                      with_unit(wanted.*p.measure, p.unit) + " at a stature of " +
                          with_unit(wanted.stature, "m") + " and a mass of " +
                          with_unit(wanted.mass, "kg"),
                      with_unit(expected * std::exp(-spread), "") + "to " +
                          with_unit(expected * std::exp(spread), p.unit) +
                          " there; the girths that are given speak for " +
                          with_unit(likely_mass(options), "kg"));
    }
  }
}

}  // namespace

OptionTable describe(DefaultHumanOptions& options) {
  OptionTable table;
  table.add("male", options.male, 0, 1, "",
            "Build between female (0) and male (1); size is given by the measurements");
  for (const Parameter& p : kParameters) {
    table.add(p.name, options.*p.option, 0, p.high, p.unit,
              std::string(p.help) + "; 0: average for sex, stature and mass");
  }
  table.add("correctives", options.correctives,
            "Pose correctives, which preserve the volume of bent limbs");
  table.add("shape_basis", options.shape_basis, "Linear shape parameters around this body");
  return table;
}

std::string human_options_problem(const DefaultHumanOptions& options) {
  for (const Parameter& p : kParameters) {
    const double value = options.*p.option;
    if (!(value == 0 || (value >= p.low && value <= p.high))) {
      char text[120];
      std::snprintf(text, sizeof text, "%s cannot be %.6g: it is in [%g, %g] %s, or 0 (average)",
                    p.name, value, p.low, p.high, p.unit);
      return text;
    }
  }
  DefaultHumanOptions copy = options;
  const std::vector<std::string> problems = check_options(describe(copy));
  return problems.empty() ? "" : problems.front();
}

DefaultHumanOptions female_human() {
  DefaultHumanOptions options;
  options.male = 0;
  return options;
}

DefaultHumanOptions male_human() {
  DefaultHumanOptions options;
  options.male = 1;
  return options;
}

double likely_mass(const DefaultHumanOptions& options) {
  check_human_options(options);
  // Every girth given tells the bulk, with its spread; so does the average person, with the mass's.
  const Parameter& of_stature = kParameters[0];
  const Parameter& of_mass = kParameters[1];
  const double average_stature = between(of_stature.female, of_stature.male, options.male);
  const double tall = options.stature > 0 ? std::log(options.stature / average_stature) : 0;
  const double mean = (of_mass.by_stature - 1) * tall / 2;
  double information = 4 / (of_mass.residual * of_mass.residual);
  double bulk = information * mean;
  for (const Parameter& p : kParameters) {
    if (p.by_bulk > 0 && options.*p.option > 0) {
      const double average = between(p.female, p.male, options.male);
      const double found = std::log(options.*p.option / average) - p.by_stature * tall;
      const double weight = p.by_bulk / (p.residual * p.residual);
      bulk += weight * found;
      information += weight * p.by_bulk;
    }
  }
  return between(of_mass.female, of_mass.male, options.male) *
         std::exp(tall + 2 * bulk / information);
}

BodyMeasurements expected_measures(const DefaultHumanOptions& options) {
  check_human_options(options);
  BodyMeasurements m;
  double tall = 1;
  double bulk = 1;
  for (std::size_t i = 0; i < kCount; ++i) {
    const Parameter& p = kParameters[i];
    const double average = between(p.female, p.male, options.male);
    double value = options.*p.option;
    if (value == 0) {
      value = i == 1 ? likely_mass(options)
                     : average * std::pow(tall, p.by_stature) * std::pow(bulk, p.by_bulk);
    }
    m.*p.measure = value;
    if (i == 0) {
      tall = value / average;
    } else if (i == 1) {
      bulk = std::sqrt(value / average / tall);
    }
  }
  return m;
}

namespace {

// Where a share of a normal distribution ends, by bisection of erfc.
double quantile(double share) {
  double a = -8;
  double b = 8;
  for (int i = 0; i < 60; ++i) {
    const double c = (a + b) / 2;
    (0.5 * std::erfc(-c / std::sqrt(2.0)) < share ? a : b) = c;
  }
  return (a + b) / 2;
}

// Every measure by its number of spreads from what the measures before it predict.
DefaultHumanOptions human_off_average(double male, const std::array<double, kCount>& z) {
  DefaultHumanOptions options;
  options.male = male;
  double bulk = 0;
  std::size_t i = 0;
  for (const Parameter& p : kParameters) {
    options.*p.option = 0;
    const double average = expected_measures(options).*p.measure;
    const double off = p.residual * z[i++];
    options.*p.option = std::clamp(average * std::exp(off), p.low, p.high);
    bulk += p.by_volume * off;
  }
  // Who is thicker than average at this mass weighs more.
  options.mass = std::clamp(options.mass * std::exp(bulk), kParameters[1].low, kParameters[1].high);
  return options;
}

}  // namespace

DefaultHumanOptions percentile_human(double male, const std::vector<double>& percentiles) {
  ATELIER_CHECK(male >= 0 && male <= 1, "male is a share");
  std::array<double, kCount> z{};
  ATELIER_CHECK(percentiles.size() == z.size(), "a percentile for each of the twelve measures");
  for (std::size_t i = 0; i < z.size(); ++i) {
    ATELIER_CHECK(percentiles[i] > 0 && percentiles[i] < 1, "percentiles between 0 and 1");
    z[i] = quantile(percentiles[i]);
  }
  return human_off_average(male, z);
}

DefaultHumanOptions random_human(Random& random, double male, double low, double high) {
  ATELIER_CHECK(male >= 0 && male <= 1, "male is a share");
  ATELIER_CHECK(low > 0 && low <= high && high < 1, "percentiles between 0 and 1, the lower first");
  std::array<double, kCount> z{};
  for (double& one : z) {
    one = uniform(random, quantile(low), quantile(high));
  }
  return human_off_average(male, z);
}

BodyModel default_human(const DefaultHumanOptions& options) {
  const BodyMeasurements wanted = expected_measures(options);
  check_plausible(options, wanted);
  const Maker maker;
  const Solved solved = solve_build(maker, options, wanted, likely_mass(options));
  const HumanAnatomy anatomy = human_anatomy(solved.build);

  BodyModel model;
  model.name = "default human";
  model.skeleton = human_skeleton(anatomy);
  model.mesh.vertices = maker.vertices(anatomy);
  model.mesh.faces = maker.faces;
  model.skin = human_weights(maker.half);
  HumanAtlas atlas = human_atlas(maker.half, maker.faces);
  model.mesh.uvs = std::move(atlas.uvs);
  model.mesh.uv_faces = std::move(atlas.uv_faces);
  model.groups = std::move(atlas.islands);
  if (options.correctives) {
    model.correctives = human_correctives(model.skeleton, model.skin, model.mesh.vertices);
  }
  if (!options.shape_basis) {
    return model;
  }
  // The surface follows the factors, the factors follow the measures by the inverse Jacobian.
  const Matrix jacobian = measure_jacobian(maker, solved.build);
  const Matrix inverse = jacobian.inverse();
  const double h = 0.004;
  std::vector<Points> surface(kCount);
  std::vector<Points> joints(kCount);
  const auto rest_joints = [&](const HumanAnatomy& a) {
    const Skeleton s = human_skeleton(a);
    Points p = s.offsets;
    for (Index i = 1; i < p.rows(); ++i) {
      p.row(i) += p.row(s.parents[static_cast<std::size_t>(i)]);
    }
    return p;
  };
  const auto derivative = [&](const HumanBuild& more, const HumanBuild& less, double width,
                              Points& v, Points& j) {
    const HumanAnatomy a = human_anatomy(more);
    const HumanAnatomy b = human_anatomy(less);
    v = (maker.vertices(a) - maker.vertices(b)) / width;
    j = (rest_joints(a) - rest_joints(b)) / width;
  };
  for (std::size_t i = 0; i < kCount; ++i) {
    HumanBuild more = solved.build;
    HumanBuild less = solved.build;
    more.*kParameters[i].factor *= std::exp(h);
    less.*kParameters[i].factor *= std::exp(-h);
    derivative(more, less, 2 * h, surface[i], joints[i]);
  }
  // Stature sets the scale of everything, so that its own column is not the neck's alone.
  const auto parameter = [&](const Vector& factors, const Points& direct,
                             const Points& direct_joints, double unit, ShapeParameter& shape) {
    shape.surface.offsets = direct;
    shape.joints = direct_joints;
    for (std::size_t f = 0; f < kCount; ++f) {
      shape.surface.offsets += factors[static_cast<Index>(f)] * surface[f];
      shape.joints += factors[static_cast<Index>(f)] * joints[f];
    }
    shape.surface.offsets /= unit;
    shape.joints /= unit;
  };
  const auto held = [&](const HumanBuild& more, const HumanBuild& less, double width) {
    return Vector((log_measures(maker.measure(more)) - log_measures(maker.measure(less))) / width);
  };
  for (std::size_t i = 0; i < kCount; ++i) {
    const Parameter& p = kParameters[i];
    ShapeParameter shape;
    shape.name = p.name;
    shape.unit = p.unit;
    shape.neutral = wanted.*p.measure;
    const double spread = 3 * (p.residual + 0.02) * shape.neutral;
    shape.min = shape.neutral - spread;
    shape.max = shape.neutral + spread;
    Vector unit = Vector::Zero();
    unit[static_cast<Index>(i)] = 1;
    Points direct = Points::Zero(model.mesh.vertices.rows(), 3);
    Points direct_joints = Points::Zero(model.skeleton.offsets.rows(), 3);
    Vector wanted_slope = unit;
    if (i == 0) {
      HumanBuild more = solved.build;
      HumanBuild less = solved.build;
      more.stature *= std::exp(h);
      less.stature *= std::exp(-h);
      derivative(more, less, 2 * h, direct, direct_joints);
      wanted_slope -= held(more, less, 2 * h);
    }
    parameter(inverse * wanted_slope, direct, direct_joints, shape.neutral, shape);
    model.shape.push_back(std::move(shape));
  }
  // Build between female and male at the same measures.
  ShapeParameter build;
  build.name = "male";
  build.neutral = options.male;
  build.min = 0;
  build.max = 1;
  HumanBuild more = solved.build;
  HumanBuild less = solved.build;
  more.male += 0.05;
  less.male -= 0.05;
  Points direct, direct_joints;
  derivative(more, less, 0.1, direct, direct_joints);
  parameter(inverse * Vector(-held(more, less, 0.1)), direct, direct_joints, 1, build);
  model.shape.push_back(std::move(build));
  return model;
}

}  // namespace atelier
