#include "pipeline/avatar/avatar_crops.h"

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <string>

#include "bodymodel/humanoid.h"
#include "pipeline/avatar/avatar_drawing.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Vertices of a detail, and what it is called.
struct Detail {
  std::string name;
  std::vector<Index> vertices;
};

/// The vertices that a joint or one below it moves most.
std::vector<Index> moved_below(const BodyModel& model, int joint) {
  std::set<int> joints = {joint};
  const std::vector<int>& parents = model.skeleton.parents;
  for (std::size_t j = 0; j < parents.size(); ++j) {
    if (joints.contains(parents[j])) {
      joints.insert(static_cast<int>(j));
    }
  }
  std::vector<Index> vertices;
  for (Index v = 0; v < model.skin.weights.rows(); ++v) {
    Index most = 0;
    model.skin.weights.row(v).maxCoeff(&most);
    if (joints.contains(model.skin.joints(v, most))) {
      vertices.push_back(v);
    }
  }
  return vertices;
}

std::vector<Detail> details_of(const BodyModel& model) {
  const std::optional<Humanoid> person = find_humanoid(model.skeleton);
  if (!person) {
    return {};
  }
  std::vector<Detail> details;
  const std::array<std::pair<const char*, int>, 5> places = {
      {{"head", person->neck.back()},
       {"left hand", person->arms[0].wrist},
       {"left foot", person->legs[0].ankle},
       {"right hand", person->arms[1].wrist},
       {"right foot", person->legs[1].ankle}}};
  for (const auto& [name, joint] : places) {
    if (joint >= 0) {
      details.push_back({name, moved_below(model, joint)});
    }
  }
  return details;
}

/// A square of an image.
struct Square {
  int x = 0, y = 0, side = 0;
};

/// Round a detail as a camera sees it; nothing where it lies outside of the image.
std::optional<Square> square_round(const Detail& detail, const Points& vertices,
                                   const Camera& camera) {
  constexpr double kMargin = 1.3;
  constexpr double kFewest = 32;  // pixels a side
  Eigen::Array2d low(1e9, 1e9);
  Eigen::Array2d high(-1e9, -1e9);
  for (const Index v : detail.vertices) {
    const auto at = project(camera, vertices.row(v).transpose());
    if (!at) {
      return std::nullopt;
    }
    low = low.min(at->array());
    high = high.max(at->array());
  }
  const Eigen::Array2d size(camera.width, camera.height);
  if (!(low >= 0).all() || !(high < size).all()) {
    return std::nullopt;
  }
  const double side = std::min({kMargin * (high - low).maxCoeff(), size.minCoeff(),
                                std::max(kFewest, kMargin * (high - low).maxCoeff())});
  const Eigen::Array2d corner = ((low + high - side) / 2).max(0).min(size - side);
  return Square{static_cast<int>(corner.x()), static_cast<int>(corner.y()),
                std::max(1, static_cast<int>(side))};
}

/// Share of a square that a view draws.
double drawn_share(const Square& square, const AppearanceView& view, int width) {
  double count = 0;
  for (const int pixel : view.pixel) {
    const int x = pixel % width - square.x;
    const int y = pixel / width - square.y;
    count += x >= 0 && y >= 0 && x < square.side && y < square.side ? 1 : 0;
  }
  return count / (static_cast<double>(square.side) * square.side);
}

Image cut_out(const Image& image, const Square& square, int side) {
  Image part(square.side, square.side, 3);
  for (int y = 0; y < square.side; ++y) {
    const std::size_t from =
        3 * (static_cast<std::size_t>(square.y + y) * static_cast<std::size_t>(image.width) +
             static_cast<std::size_t>(square.x));
    std::copy_n(
        &image.data[from], 3 * static_cast<std::size_t>(square.side),
        &part.data[3 * static_cast<std::size_t>(y) * static_cast<std::size_t>(square.side)]);
  }
  return resized(part, side, side);
}

/// `count` of the numbers below `of`, evenly.
std::vector<std::size_t> spread(std::size_t count, std::size_t of) {
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < std::min(count, of); ++i) {
    all.push_back(i * of / std::min(count, of));
  }
  return all;
}

/// The first of the details, from the one whose turn it is, that the view shows.
std::optional<std::pair<Square, std::string>> shown_detail(const std::vector<Detail>& details,
                                                           std::size_t turn, const Points& vertices,
                                                           const AppearanceView& view,
                                                           const Camera& camera) {
  constexpr double kShown = 0.08;  // of the square
  for (std::size_t i = 0; i < details.size(); ++i) {
    const Detail& detail = details[(turn + i) % details.size()];
    const auto square = square_round(detail, vertices, camera);
    if (square && drawn_share(*square, view, camera.width) > kShown) {
      return std::pair(*square, detail.name);
    }
  }
  return std::nullopt;
}

}  // namespace

std::vector<CaptionedImage> avatar_crops(const AvatarInput& input, const DressedSubject& subject,
                                         const AppearanceModel& model, const fs::path& file,
                                         const ReadPicture& read, Device device) {
  constexpr int kSide = 512;
  constexpr std::size_t kCameras = 5;
  constexpr std::size_t kFrames = 4;
  const std::vector<std::size_t> which = spread(kCameras, input.cameras.size());
  std::vector<Camera> cameras;
  for (const std::size_t c : which) {
    cameras.push_back(input.cameras[c]);
  }
  std::vector<int> frames;
  for (const std::size_t f : spread(kFrames, input.frame_ids.size())) {
    frames.push_back(input.frame_ids[f]);
  }
  DrawnSurface surface;
  surface.atlas = {model.uvs, model.uv_faces, {}};
  surface.trusted_only = false;
  surface.fewest_pixels = 0;
  PrepareAppearanceOptions options;
  options.occlusion = model.occlusion.value_or(options.occlusion);
  const AppearanceData asked =
      prepare_appearance(subject, surface, {cameras, frames}, options, device);
  const std::vector<Detail> details = details_of(input.person.model);
  if (asked.views.empty() || details.empty()) {
    return {};
  }
  const AppearanceColors colors = avatar_colors(file, model, asked);
  std::vector<CaptionedImage> pairs;
  std::size_t first = 0;
  for (std::size_t i = 0; i < asked.views.size(); ++i) {
    const AppearanceView& view = asked.views[i];
    const auto c = static_cast<std::size_t>(view.camera_idx);
    const int id = frames[static_cast<std::size_t>(view.frame_idx)];
    const std::size_t begin = first;
    first += view.pixel.size();
    const TakenPicture taken = read(which[c], id);
    if (taken.colors.data.empty()) {
      continue;
    }
    const auto detail = shown_detail(details, i, subject.load(id)[0], view, cameras[c]);
    if (!detail) {
      continue;
    }
    const float* gain = &model.static_gain[3 * which[c]];
    const Image picture = linear_from_srgb(taken.colors);
    const Image drawn =
        with_drawn_pixels(Image(picture.width, picture.height, 3, 0.6F), view, colors.drawn, begin,
                          Eigen::Vector3d(gain[0], gain[1], gain[2]));
    const std::string name =
        "frame " + std::to_string(id) + ", camera " + cameras[c].id + ": " + detail->second;
    pairs.push_back({cut_out(picture, detail->first, kSide), name + ", taken"});
    pairs.push_back({cut_out(drawn, detail->first, kSide), "drawn"});
  }
  return pairs;
}

}  // namespace atelier
