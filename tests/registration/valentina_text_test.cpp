#include "registration/drafting/valentina_text.h"

#include <cmath>
#include <map>
#include <numbers>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atelier {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// A skirt's half: straight sides, an arc below with a hem, a cubic above.
SewingPattern half_skirt() {
  Panel panel;
  panel.name = "front & \"back\"";
  panel.corners.resize(4, 2);
  panel.corners << 0, 0, 0.4, 0, 0.35, 0.6, 0.05, 0.6;
  panel.edges = {{.start = 0, .end = 1, .controls = {}, .name = "hem", .bulge = 0.2},
                 {.start = 1, .end = 2, .controls = {}, .name = ""},
                 {.start = 2, .end = 3, .controls = {{0.25, 0.55}, {0.15, 0.55}}, .name = "waist"},
                 {.start = 3, .end = 0, .controls = {}, .name = ""}};
  return {"skirt", {panel}, {}};
}

using Tag = std::map<std::string, std::string>;

/// The tags of one element and the attributes of each, in order.
std::vector<Tag> tags_of(const std::string& text, const std::string& element) {
  std::vector<Tag> tags;
  const std::regex tag("<" + element + " ([^>]*)>");
  const std::regex attribute("([a-zA-Z0-9]+)=\"([^\"]*)\"");
  for (std::sregex_iterator at(text.begin(), text.end(), tag), end; at != end; ++at) {
    const std::string inside = (*at)[1];
    Tag one;
    for (std::sregex_iterator a(inside.begin(), inside.end(), attribute); a != end; ++a) {
      one[(*a)[1]] = (*a)[2];
    }
    tags.push_back(one);
  }
  return tags;
}

/// Where Valentina would put the points of the calculation, centimetres, up positive.
std::map<std::string, Eigen::Vector2d> points_of(const std::string& text) {
  std::map<std::string, Eigen::Vector2d> points;
  for (const Tag& tag : tags_of(text, "point")) {
    if (tag.at("type") == "single") {
      points[tag.at("id")] = {std::stod(tag.at("x")), -std::stod(tag.at("y"))};
    } else if (tag.at("type") == "endLine") {
      const double angle = std::stod(tag.at("angle")) * std::numbers::pi / 180;
      points[tag.at("id")] =
          points.at(tag.at("basePoint")) +
          std::stod(tag.at("length")) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    }
  }
  return points;
}

TEST(ValentinaText, Panel_LiesWhereItIsLaidOutClockwise) {
  const SewingPattern pattern = half_skirt();
  const PatternPieceOptions options;
  const PatternLayout layout = lay_out_pieces(pattern, options);
  const std::string text = valentina_text(pattern, layout, options, "a skirt");
  const auto points = points_of(text);
  std::map<std::string, std::string> object_of;
  for (const char* element : {"point", "spline"}) {
    for (const Tag& tag : tags_of(text, element)) {
      if (tag.contains("idObject")) {
        object_of[tag.at("id")] = tag.at("idObject");
      }
    }
  }
  std::vector<Eigen::Vector2d> corners;
  for (const Tag& node : tags_of(text, "node")) {
    if (node.at("type") == "NodePoint") {
      corners.push_back(points.at(object_of.at(node.at("idObject"))));
    } else {
      EXPECT_EQ(node.at("reverse"), "1");
    }
  }
  ASSERT_GE(corners.size(), 4U);
  double twice = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d& a = corners[i];
    const Eigen::Vector2d& b = corners[(i + 1) % corners.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  EXPECT_LT(twice, 0) << "clockwise";
  // The arc is drawn in pieces, whose corners lie on it.
  EXPECT_NEAR(-twice / 2, 1e4 * panel_area(pattern.panels[0]), 150);
  const Points2& drawn = layout.pieces[0].sew_line;
  for (const Eigen::Vector2d& corner : corners) {
    EXPECT_LT((drawn.rowwise() - corner.transpose() / 100).rowwise().norm().minCoeff(), 3e-3);
  }
}

TEST(ValentinaText, Curves_KeepTheirLength) {
  const SewingPattern pattern = half_skirt();
  const PatternLayout layout = lay_out_pieces(pattern);
  const std::string text = valentina_text(pattern, layout, {}, "");
  const auto points = points_of(text);
  double length = 0;
  for (const Tag& spline : tags_of(text, "spline")) {
    if (!spline.contains("point1")) {
      continue;
    }
    Eigen::Vector2d before = points.at(spline.at("point1"));
    for (int i = 1; i <= 200; ++i) {
      const double t = i / 200.0;
      const double s = 1 - t;
      const Eigen::Vector2d here = s * s * s * points.at(spline.at("point1")) +
                                   3 * s * s * t * points.at(spline.at("point2")) +
                                   3 * s * t * t * points.at(spline.at("point3")) +
                                   t * t * t * points.at(spline.at("point4"));
      length += (here - before).norm();
      before = here;
    }
  }
  const Panel& panel = pattern.panels[0];
  EXPECT_NEAR(length, 100 * (edge_length(panel, 0) + edge_length(panel, 2)), 1e-2);
}

TEST(ValentinaText, HemsAndNames_AreSaidAndNumbersAreUnique) {
  SewingPattern pattern = half_skirt();
  for (int i = 1; i < 28; ++i) {  // more than there are letters
    pattern.panels.push_back(pattern.panels[0]);
    pattern.panels.back().name = "panel " + std::to_string(i);
  }
  const std::string text =
      valentina_text(pattern, lay_out_pieces(pattern), {.hem_allowance = 0.03}, "<skirt>");
  EXPECT_THAT(text, HasSubstr("<description>&lt;skirt&gt;</description>"));
  EXPECT_THAT(text, HasSubstr("<draw name=\"front &amp; &quot;back&quot;\">"));
  EXPECT_THAT(text, Not(HasSubstr("front & ")));
  EXPECT_THAT(text, HasSubstr(" before=\"3.0000000\""));
  EXPECT_THAT(text, HasSubstr(" after=\"3.0000000\""));
  std::set<std::string> ids;
  std::set<std::string> names;
  for (const char* element : {"point", "spline", "detail"}) {
    for (const Tag& tag : tags_of(text, element)) {
      EXPECT_TRUE(ids.insert(tag.at("id")).second) << tag.at("id");
      if (tag.contains("name") && element == std::string("point")) {
        EXPECT_TRUE(names.insert(tag.at("name")).second) << tag.at("name");
      }
    }
  }
  EXPECT_TRUE(names.contains("AB1")) << "the 28th panel";
}

}  // namespace
}  // namespace atelier
