#include "bodymodel/human/human_anatomy.h"

#include <algorithm>
#include <cmath>

#include "core/saturating_cast.h"
#include "core/smooth_step.h"

namespace atelier {
namespace {

// All lengths below are thousandths of stature. Outlines are smooth profiles set by hand between
// the measures that anthropometric tables have; docs/methods/default_human.md says how and against
// what.

struct TrunkRow {
  double y, side, front, back, nf, nb;
};
constexpr int kTrunkRows = 17;
constexpr TrunkRow kTrunkFemale[kTrunkRows] = {
    {478, 97, 46, -60, 2.2, 2.1}, {500, 106, 55, -70, 2.2, 2.1}, {522, 103, 63, -73, 2.2, 2.1},
    {560, 93, 73, -55, 2.3, 2.3}, {600, 82, 77, -30, 2.2, 2.8},  {635, 72.5, 78, -24, 2.2, 3.2},
    {680, 75, 78, -28, 2.3, 3.0}, {720, 81, 75, -38, 2.4, 3.0},  {760, 89, 66, -51, 2.4, 3.0},
    {790, 97, 54, -54, 2.3, 2.9}, {810, 100, 42, -52, 1.9, 2.8}, {822, 95, 35, -48, 1.5, 2.8},
    {832, 77, 30, -40, 1.4, 2.5}, {845, 43, 27, -33, 1.6, 2.2},  {865, 28.5, 32, -23, 2.0, 2.0},
    {890, 27, 34, -19, 2.0, 2.0}, {920, 26, 34, -19, 2.0, 2.0}};
constexpr TrunkRow kTrunkMale[kTrunkRows] = {
    {478, 90, 42, -54, 2.2, 2.1},  {500, 95, 52, -68, 2.3, 2.1},  {522, 92, 59, -73, 2.3, 2.1},
    {560, 84, 65, -66, 2.5, 2.3},  {600, 79, 65, -47, 2.5, 2.8},  {635, 76.5, 63, -43, 2.5, 3.2},
    {680, 82, 66, -51, 2.8, 3.2},  {720, 92, 66, -57, 3.0, 3.2},  {760, 101, 59, -60, 3.2, 3.2},
    {790, 108, 48, -60, 3.0, 3.0}, {810, 110, 39, -56, 2.4, 2.8}, {822, 107, 33, -50, 1.8, 2.7},
    {832, 97, 31, -43, 1.5, 2.5},  {845, 62, 33, -36, 1.6, 2.2},  {865, 34, 38, -28, 2.0, 2.0},
    {890, 31, 40, -24, 2.0, 2.0},  {920, 29, 38, -24, 2.0, 2.0}};

struct LimbRow {
  double t, out, in, front, back;
};
// t: 0 hip, 1 knee, 2 ankle.
constexpr int kLegRows = 15;
constexpr LimbRow kLegFemale[kLegRows] = {
    {-0.12, 20, 34, 28, 27},  {0.06, 40, 50, 52, 49},     {0.20, 49, 57, 64, 50},
    {0.30, 48, 57, 65, 40},   {0.50, 41.5, 50, 63, 33},   {0.70, 33, 43, 53, 31},
    {0.88, 29, 38, 41, 30},   {1.00, 30, 34, 34, 33},     {1.12, 33, 29, 21, 39},
    {1.30, 37.5, 26, 18, 48}, {1.50, 34.5, 23, 15.5, 44}, {1.70, 27.5, 14.5, 13, 32},
    {1.88, 19, 10, 16, 22},   {2.00, 19, 12.5, 19, 20},   {2.08, 19, 14, 19, 20}};
constexpr LimbRow kLegMale[kLegRows] = {
    {-0.12, 18, 34, 28, 26},  {0.06, 36, 50, 53, 45},     {0.20, 42, 58, 63, 42},
    {0.30, 41, 57, 64, 38},   {0.50, 38.5, 51, 62, 34},   {0.70, 33, 43, 51, 31},
    {0.88, 28, 36, 41, 32},   {1.00, 27.5, 30, 31, 40},   {1.12, 33, 26, 21, 44},
    {1.30, 35.5, 29, 17, 49}, {1.50, 31.5, 26, 14.5, 41}, {1.70, 25, 17.5, 14, 32},
    {1.88, 20, 10.5, 18, 27}, {2.00, 20, 14, 20, 25},     {2.08, 20, 15, 20, 24}};
// t: 0 shoulder, 1 elbow, 2 wrist.
constexpr int kArmRows = 16;
constexpr LimbRow kArmFemale[kArmRows] = {
    {-0.17, 4, 4, 4, 5},        {-0.155, 11, 11, 11, 13},       {-0.11, 20, 20, 20, 25},
    {-0.05, 27, 26, 27, 34},    {0.02, 31, 30, 31, 40},         {0.20, 29.5, 27, 28, 33},
    {0.50, 23, 23, 24.5, 26},   {0.75, 19.5, 22.5, 23.5, 25.5}, {0.92, 18, 23, 22.5, 23.5},
    {1.02, 18, 23, 21.5, 22},   {1.15, 19.5, 23.5, 20, 22},     {1.30, 19, 22.5, 18, 21.5},
    {1.50, 17, 19.5, 15.5, 20}, {1.72, 14, 15, 13.7, 16.5},     {1.90, 11, 11.5, 13.6, 14.2},
    {2.02, 9.3, 10.5, 14, 14}};
constexpr LimbRow kArmMale[kArmRows] = {{-0.17, 4, 4, 5, 5},
                                        {-0.155, 11, 11, 13, 13},
                                        {-0.11, 20, 20, 24, 24},
                                        {-0.05, 27, 27, 32, 29},
                                        {0.02, 30.5, 30, 36, 33},
                                        {0.20, 27, 30, 33, 34},
                                        {0.50, 23, 25.5, 27, 31},
                                        {0.75, 21, 25.5, 27, 27.5},
                                        {0.92, 20, 24.5, 26, 23},
                                        {1.02, 19, 23, 26.5, 20},
                                        {1.15, 21, 23.5, 26, 19.5},
                                        {1.30, 21, 23.5, 25, 19},
                                        {1.50, 19.5, 20.5, 20.5, 18.5},
                                        {1.72, 16.5, 16.5, 17.3, 16.5},
                                        {1.90, 12.5, 12.7, 15.8, 14.8},
                                        {2.02, 10.3, 11.5, 15.5, 15.3}};

struct BumpRow {
  double x, y, sx, above, below, female, male;
  bool front;
};
constexpr BumpRow kBumps[] = {
    {52, 732, 31, 42, 21, 24, 0, true},     // breast
    {49, 746, 37, 38, 20, 0, 10, true},     // pectoral muscle
    {0, 823, 9, 8, 9, -4, -4, true},        // notch over the breastbone
    {46, 817, 34, 7, 7, 2.5, 3, true},      // collarbone
    {0, 690, 9, 42, 40, -2, -3, true},      // line down the belly
    {0, 629, 6.5, 6.5, 6, -5, -5, true},    // navel
    {0, 870, 9, 8, 10, 0, 3, true},         // larynx
    {0, 478, 11, 34, 40, -26, -24, false},  // cleft between the buttocks
    {0, 520, 9, 26, 26, -10, -12, false},  {0, 775, 24, 60, 60, -9, -15, false},
    {0, 580, 16, 28, 22, -3, -7, false},  // sacrum
    {38, 516, 30, 32, 34, 4, 8, false},   // gluteal muscle
    {0, 640, 12, 60, 60, -4, -3, false},  // groove of the spine
    {0, 725, 13, 35, 30, -4, -3, true},   // between the breasts
};

double mix(double female, double male, double share) {
  return female + share * (male - female);
}

Vec3d along(Vec3d a, Vec3d b, double t) {
  return a + t * (b - a);
}

// Slope at a station that keeps monotone data monotone (Fritsch and Carlson 1980, as in PCHIP).
double slope(double before, double after) {
  return before * after <= 0 ? 0.0 : 2 * before * after / (before + after);
}

// Where a station lies between its rows, and the weights of Hermite's cubic there: the same for
// every field of a section.
struct Place {
  int row;
  int last;  // the last interval's
  double t;
  double value0, slope0, value1, slope1;
};

Place place_of(const std::vector<HumanSection>& rows, double tau) {
  const int last = static_cast<int>(rows.size()) - 2;
  const int row = std::clamp(saturating_cast<int>(std::floor(tau)), 0, last);
  const double t = tau - row;
  const double t2 = t * t;
  const double t3 = t2 * t;
  return {row, last, t, 2 * t3 - 3 * t2 + 1, t3 - 2 * t2 + t, -2 * t3 + 3 * t2, t3 - t2};
}

double interpolate(const std::vector<HumanSection>& rows, double HumanSection::*field,
                   const Place& place) {
  const int i = place.row;
  const auto value = [&](int k) { return rows[static_cast<std::size_t>(k)].*field; };
  const auto difference = [&](int k) { return value(k + 1) - value(k); };
  const double d = difference(i);
  const double m0 = i > 0 ? slope(difference(i - 1), d) : d;
  const double m1 = i < place.last ? slope(d, difference(i + 1)) : d;
  if (place.t <= 0) {
    return value(i) + place.t * m0;
  }
  if (place.t >= 1) {
    return value(i + 1) + (place.t - 1) * m1;
  }
  return place.value0 * value(i) + place.slope0 * m0 + place.value1 * value(i + 1) +
         place.slope1 * m1;
}

constexpr double kAnkleHeight = 42;
constexpr double kCrotchHeight = 475;
constexpr double kNeckHeight = 838;
constexpr double kHeadHeight = 893;

// Where the height `y` of the tables is in this build: legs, torso and neck stretch, ankle and head
// do not.
double height_of(const HumanBuild& build, double y) {
  const double leg = kAnkleHeight + build.leg * (kCrotchHeight - kAnkleHeight);
  const double torso = leg + build.torso * (kNeckHeight - kCrotchHeight);
  const double neck = torso + build.neck_length * (kHeadHeight - kNeckHeight);
  if (y <= kAnkleHeight) {
    return y;
  }
  if (y <= kCrotchHeight) {
    return kAnkleHeight + build.leg * (y - kAnkleHeight);
  }
  if (y <= kNeckHeight) {
    return leg + build.torso * (y - kCrotchHeight);
  }
  if (y <= kHeadHeight) {
    return torso + build.neck_length * (y - kNeckHeight);
  }
  return neck + y - kHeadHeight;
}

double hand_factor(const HumanBuild& build) {
  return std::sqrt(build.arm);
}

struct FactorKnot {
  double at;
  double value;
};

// Factors between their knots: smooth steps of the logarithm.
template <std::size_t N>
double between(const FactorKnot (&knots)[N], double at) {
  for (std::size_t i = 0; i + 1 < N; ++i) {
    if (at <= knots[i + 1].at) {
      const double t = smooth_step(at, knots[i].at, knots[i + 1].at);
      return std::exp((1 - t) * std::log(knots[i].value) + t * std::log(knots[i + 1].value));
    }
  }
  return knots[N - 1].value;
}

double trunk_factor(const HumanBuild& b, double y) {
  const FactorKnot knots[] = {{530, b.hip},
                              {575, std::sqrt(b.hip * b.waist * b.fullness)},
                              {625, b.waist},
                              {645, b.waist},
                              {685, std::sqrt(b.waist * b.chest * b.fullness)},
                              {722, b.chest},
                              {765, b.chest},
                              {810, 0.5 + 0.5 * b.chest},
                              {830, b.neck}};
  return between(knots, y);
}

// Beside the armpit a thicker chest grows to front and back: the arm's root does not move away.
double side_factor(double girth, double y) {
  const double beside = smooth_step(y, 715, 750) * (1 - smooth_step(y, 805, 830));
  const double more = girth - 1;
  const double softness = 0.05;  // of the bend between thinner, which is free, and thicker
  const double growth = (more + std::hypot(more, softness) - softness) / 2;
  return girth - 0.6 * beside * growth;
}

double leg_factor(const HumanBuild& b, double t) {
  const double calf = std::pow(b.thigh, 0.7) * b.fullness;
  const FactorKnot knots[] = {{0.0, std::sqrt(b.hip * b.thigh)},
                              {0.2, b.thigh},
                              {0.45, b.thigh},
                              {0.95, std::sqrt(calf)},
                              {1.2, calf},
                              {1.6, calf},
                              {2.0, std::sqrt(calf)}};
  return between(knots, t);
}

double arm_factor(const HumanBuild& b, double t) {
  const double forearm = std::pow(b.upper_arm, 0.7) * b.fullness;
  const FactorKnot knots[] = {
      {0.05, std::sqrt(b.upper_arm)}, {0.3, b.upper_arm}, {0.7, b.upper_arm},
      {1.0, std::sqrt(forearm)},      {1.2, forearm},     {1.6, forearm},
      {2.0, std::sqrt(forearm)}};
  return between(knots, t);
}

// Joint centres. Heights: Drillis and Contini 1966, as printed in Winter, "Biomechanics and Motor
// Control of Human Movement", fig. 4.1 (ankle 39, knee 285, hip 530, shoulder 818 from the ground;
// hand 108, foot 152); hip joint centre lower than the trochanter's top and 57 from the middle
// (Seidel et al. 1995: 14% of pelvis width inwards); phalanges: Buryanov and Kotiuk 2010, table 1.
HumanJoints joints(const HumanBuild& build) {
  const double male = build.male;
  const double k = build.stature / 1000;
  const auto at = [&](double x, double y, double z) {
    return Vec3d{k * x, k * height_of(build, y), k * z};
  };
  HumanJoints j;
  j.pelvis = at(0, 535, 0);
  j.spine1 = at(0, 597, 6);
  j.spine2 = at(0, 662, 8);
  j.spine3 = at(0, 724, 2);
  j.neck = at(0, kNeckHeight, -4);
  j.head = at(0, kHeadHeight, 8);
  j.jaw = at(0, 905, 28);
  j.eye = at(18.2, 935, 57);
  j.hip = at(57, 517, mix(-3, -11, male));
  j.knee = at(75, 286, mix(10, 2, male));
  j.ankle = at(90, kAnkleHeight, -2);
  j.toes = at(97, 13, 72);
  const double shoulder = build.shoulder * mix(97, 107, male);
  j.collar = at(16, 800, 6);
  j.shoulder = at(shoulder, mix(795, 798, male), -2);
  const double h = std::sqrt(0.5);
  const Vec3d arm = {h, -h, 0};
  j.elbow = j.shoulder + (k * 160 * build.arm) * arm;
  j.wrist = j.elbow + (k * 146 * build.arm) * arm;
  // Hand: the arm's axis, the thumb's side (+z) and the palm's side.
  const Vec3d palm = {-h, -h, 0};
  const Vec3d thumb_side = {0, 0, 1};
  const double hand = k * 108 / 182 * hand_factor(build);  // the tables are for a hand of 182 mm
  const auto hand_at = [&](double s, double w, double p) {
    return j.wrist + hand * (s * arm + w * thumb_side + p * palm);
  };
  struct FingerRow {
    double s, w, spread, curl, lengths[3];
  };
  constexpr FingerRow kFingers[4] = {{88, 29, 7, 10, {39.8, 22.4, 19.6}},
                                     {90, 8.5, 1.5, 10, {44.6, 26.3, 21.3}},
                                     {84, -11.5, -5, 11, {41.4, 25.7, 21.3}},
                                     {77, -30, -12, 13, {32.7, 18.1, 19.7}}};
  constexpr double kDegree = 3.14159265358979323846 / 180;
  for (std::size_t f = 0; f < 4; ++f) {
    const FingerRow& row = kFingers[f];
    Vec3d p = hand_at(row.s, row.w, 0);
    j.fingers[f + 1][0] = p;
    double curl = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      curl += row.curl * kDegree;
      const Vec3d out =
          std::cos(row.spread * kDegree) * arm + std::sin(row.spread * kDegree) * thumb_side;
      p += (hand * row.lengths[i]) * (std::cos(curl) * out + std::sin(curl) * palm);
      j.fingers[f + 1][i + 1] = p;
    }
  }
  j.fingers[0][0] = hand_at(18, 20, 6);
  j.fingers[0][1] = hand_at(50, 46, 18);
  j.fingers[0][2] = hand_at(76, 61, 25);
  j.fingers[0][3] = hand_at(99, 71, 29);
  return j;
}

}  // namespace

HumanAnatomy human_anatomy(const HumanBuild& build) {
  HumanAnatomy body;
  const double male = build.male;
  const double k = build.stature / 1000;
  body.build = build;
  body.joints = joints(build);
  const HumanJoints& j = body.joints;

  body.trunk.origin = {0, 0, 0};
  body.trunk.axis = {0, 1, 0};
  body.trunk.u = {1, 0, 0};
  body.trunk.v = {0, 0, 1};
  // How far the shoulder joints stand from where the tables have them.
  const double spread = j.shoulder.x - k * mix(97, 107, male);
  for (int i = 0; i < kTrunkRows; ++i) {
    const TrunkRow& f = kTrunkFemale[i];
    const TrunkRow& m = kTrunkMale[i];
    const double y = mix(f.y, m.y, male);
    const double girth = trunk_factor(build, y);
    const double side = side_factor(girth, y) * k * mix(f.side, m.side, male) +
                        spread * smooth_step(y, 700, 790) * (1 - smooth_step(y, 825, 850));
    const double front = k * mix(f.front, m.front, male);
    const double back = k * mix(f.back, m.back, male);
    const double depth = girth * (front - back) / 2;
    body.trunk.sections.push_back({k * height_of(build, y), 0, (front + back) / 2, side, side,
                                   depth, depth, mix(f.nf, m.nf, male), mix(f.nb, m.nb, male)});
  }
  const auto limb = [&](const LimbRow* female, const LimbRow* m, int rows, Vec3d a, Vec3d b,
                        Vec3d c, bool leg, HumanTube& tube) {
    for (int i = 0; i < rows; ++i) {
      const double t = mix(female[i].t, m[i].t, male);
      const Vec3d p = (t <= 1 ? along(a, b, t) : along(b, c, t - 1)) - tube.origin;
      const double girth = k * (leg ? leg_factor(build, t) : arm_factor(build, t));
      // Inner thighs stay apart, and so do arm and flank: thicker limbs grow to the other sides.
      const double inner = leg ? smooth_step(t, 0.45, 0.8) : smooth_step(t, 0.2, 0.5);
      const double front = girth * mix(female[i].front, m[i].front, male);
      const double back = girth * mix(female[i].back, m[i].back, male);
      // The calf's widest place is behind the bone: its section is centred in its depth.
      const double shift = (leg ? smooth_step(t, 0.95, 1.25) : 0.0) * (front - back) / 2;
      tube.sections.push_back({dot(p, tube.axis), dot(p, tube.u), dot(p, tube.v) + shift,
                               girth * mix(female[i].out, m[i].out, male),
                               (k + inner * (girth - k)) * mix(female[i].in, m[i].in, male),
                               front - shift, back + shift, 2, 2});
    }
  };
  body.leg.origin = j.hip;
  body.leg.axis = {0, -1, 0};
  body.leg.u = {1, 0, 0};
  body.leg.v = {0, 0, 1};
  limb(kLegFemale, kLegMale, kLegRows, j.hip, j.knee, j.ankle, true, body.leg);
  const double h = std::sqrt(0.5);
  body.arm.origin = j.shoulder;
  body.arm.axis = {h, -h, 0};
  body.arm.u = {h, h, 0};
  body.arm.v = {0, 0, 1};
  limb(kArmFemale, kArmMale, kArmRows, j.shoulder, j.elbow, j.wrist, false, body.arm);
  for (const BumpRow& row : kBumps) {
    const double above = height_of(build, row.y + row.above) - height_of(build, row.y);
    const double below = height_of(build, row.y) - height_of(build, row.y - row.below);
    const double girth = trunk_factor(build, row.y);
    body.bumps.push_back({k * row.x * girth, k * height_of(build, row.y), k * row.sx * girth,
                          k * above, k * below, k * girth * mix(row.female, row.male, male),
                          row.front});
  }
  return body;
}

HumanSection section_at(const HumanTube& tube, double tau) {
  const Place place = place_of(tube.sections, tau);
  const auto get = [&](double HumanSection::*field) {
    return interpolate(tube.sections, field, place);
  };
  HumanSection s;
  s.s = get(&HumanSection::s);
  s.cu = get(&HumanSection::cu);
  s.cv = get(&HumanSection::cv);
  s.pu = get(&HumanSection::pu);
  s.mu = get(&HumanSection::mu);
  s.pv = get(&HumanSection::pv);
  s.mv = get(&HumanSection::mv);
  s.np = get(&HumanSection::np);
  s.nm = get(&HumanSection::nm);
  return s;
}

double station_at(const HumanTube& tube, double s) {
  const std::vector<HumanSection>& rows = tube.sections;
  const int n = static_cast<int>(rows.size());
  int i = 0;
  while (i < n - 2 && rows[static_cast<std::size_t>(i) + 1].s <= s) {
    ++i;
  }
  const double s0 = rows[static_cast<std::size_t>(i)].s;
  const double s1 = rows[static_cast<std::size_t>(i) + 1].s;
  const auto value = [&](double tau) {
    return interpolate(rows, &HumanSection::s, place_of(rows, tau));
  };
  double t = i + (s - s0) / (s1 - s0);
  if (s <= s0 || s >= s1) {  // outside: the slope is constant
    const double end = s <= s0 ? i : i + 1;
    const double gradient = s <= s0 ? value(end) - value(end - 1) : value(end + 1) - value(end);
    return end + (s - value(end)) / gradient;
  }
  double low = i;
  double high = i + 1;
  for (int step = 0; step < 40; ++step) {  // monotone cubic: regula falsi falls back to halving
    const double e = value(t) - s;
    if (std::abs(e) < 1e-13) {
      break;
    }
    (e < 0 ? low : high) = t;
    const double d = (value(t + 1e-6) - value(t - 1e-6)) / 2e-6;
    const double next = t - e / d;
    t = next > low && next < high ? next : (low + high) / 2;
  }
  return t;
}

double section_radius(const HumanSection& section, double cos_phi, double sin_phi) {
  const double n = sin_phi >= 0 ? section.np : section.nm;
  const double a = std::abs(cos_phi) / (cos_phi >= 0 ? section.pu : section.mu);
  const double b = std::abs(sin_phi) / (sin_phi >= 0 ? section.pv : section.mv);
  if (n == 2) {
    return 1 / std::sqrt(a * a + b * b);
  }
  return std::pow(std::pow(a, n) + std::pow(b, n), -1 / n);
}

double bump_height(const HumanAnatomy& anatomy, double x, double y, bool front) {
  double height = 0;
  for (const HumanBump& bump : anatomy.bumps) {
    if (bump.front != front || bump.height == 0) {
      continue;
    }
    const double b = (y - bump.y) / (y > bump.y ? bump.above : bump.below);
    if (std::abs(b) > 4) {
      continue;
    }
    const double a = (x - bump.x) / bump.sx;
    const double c = (x + bump.x) / bump.sx;
    // Flatter on top and steeper beside than a Gaussian.
    const auto hill = [&](double u) {
      const double r2 = u * u + b * b;
      return r2 > 9 ? 0.0 : std::exp(-std::pow(r2, 1.3));
    };
    height += bump.height * (bump.x == 0 ? hill(a) : hill(a) + hill(c));
  }
  return height;
}

}  // namespace atelier
