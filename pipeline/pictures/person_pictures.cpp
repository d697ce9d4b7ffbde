#include "pipeline/pictures/person_pictures.h"

#include <algorithm>
#include <cstdio>

#include "core/error.h"
#include "core/render/contact_sheet.h"
#include "core/render/drawing.h"
#include "core/render/studio.h"

namespace atelier {
namespace {

constexpr int kPersonWidth = 900;
constexpr int kPanel = 130;  // pixels, height of one series
constexpr int kMargin = 12;
constexpr int kCaption = 24;  // of a panel's words
constexpr double kWidestBar = 16;

const Eigen::Vector3f kInkColor(0.03F, 0.03F, 0.03F);
const Eigen::Vector3f kBar(0.10F, 0.30F, 0.55F);
const Eigen::Vector3f kFarColor(0.75F, 0.05F, 0.03F);

void add_panel(const FrameSeries& one, const std::vector<int>& frame_ids,
               const std::vector<char>& trusted, double top, std::vector<Mark>& marks) {
  const double most =
      one.values.empty() ? 0 : *std::max_element(one.values.begin(), one.values.end());
  char words[120];
  std::snprintf(words, sizeof words, "%s: at most %.3g", one.label.c_str(), most);
  marks.emplace_back(Text{{kMargin, top + kCaption - 8}, words, 11, kInkColor});
  const double base = top + kPanel - 20;
  const double height = kPanel - kCaption - 24;
  const double step = (kPersonWidth - 2.0 * kMargin) /
                      static_cast<double>(std::max<std::size_t>(1, frame_ids.size()));
  for (std::size_t f = 0; f < frame_ids.size(); ++f) {
    const double x = kMargin + step * (static_cast<double>(f) + 0.5);
    const double y = base - (most > 0 ? height * one.values[f] / most : 0);
    marks.emplace_back(Polyline{{{x, base}, {x, y}},
                                false,
                                trusted[f] != 0 ? kBar : kFarColor,
                                std::clamp(0.7 * step, 1.0, kWidestBar)});
    // As many numbers as fit.
    const auto every = std::max<std::size_t>(1, frame_ids.size() / 20);
    if (f % every == 0) {
      marks.emplace_back(
          Text{{x, base + 14}, std::to_string(frame_ids[f]), 8, kInkColor, Text::Anchor::Center});
    }
  }
  marks.emplace_back(
      Polyline{{{kMargin, base}, {kPersonWidth - kMargin, base}}, false, kInkColor, 1});
}

}  // namespace

Image region_picture(const BodyModel& model, const std::vector<int>& vertices,
                     const std::string& caption) {
  Mesh body = model.mesh;
  body.colors = Colors(body.vertices.rows(), 3);
  body.colors.rowwise() = Eigen::RowVector3f(0.6F, 0.6F, 0.6F);
  for (const int v : vertices) {
    body.colors.row(v) << 0.9F, 0.25F, 0.05F;
  }
  PictureOptions options;
  options.width = 360;
  options.height = 540;
  options.samples = 4;
  const Image views = contact_sheet(
      {{picture_of(body, kFront, options), "front"}, {picture_of(body, kBack, options), "back"}},
      {.columns = 2});
  return contact_sheet({{views, caption}}, {.columns = 1});
}

Image frames_picture(const std::vector<int>& frame_ids, const std::vector<char>& trusted,
                     const std::vector<FrameSeries>& series) {
  ATELIER_CHECK(trusted.size() == frame_ids.size() && !series.empty(), "a word on each frame");
  std::vector<Mark> marks;
  for (std::size_t s = 0; s < series.size(); ++s) {
    ATELIER_CHECK(series[s].values.size() == frame_ids.size(), "a value for each frame");
    add_panel(series[s], frame_ids, trusted, static_cast<double>(s * kPanel), marks);
  }
  return drawn(Image(kPersonWidth, kPanel * static_cast<int>(series.size()), 3, 1.0F), marks);
}

}  // namespace atelier
