#include "pipeline/avatar/avatar_crops.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include "bodymodel/humanoid.h"
#include "pipeline/avatar/moved_vertices.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Vertices of a detail, and what it is called.
struct Detail {
  std::string name;
  std::vector<Index> vertices;
};

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
      details.push_back({name, vertices_moved_below(model, joint)});
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

/// A view's image as it was taken and as it is drawn; nothing where there is none.
struct TakenAndDrawn {
  Image taken, drawn;
};

/// @param first  of the view's pixels among all
std::optional<TakenAndDrawn> taken_and_drawn(const ShownViews& shown, const AppearanceModel& model,
                                             const AppearanceView& view, std::size_t first,
                                             const ReadPicture& read) {
  const std::size_t camera = shown.which[static_cast<std::size_t>(view.camera_idx)];
  const TakenPicture picture = read(camera, shown.frames[static_cast<std::size_t>(view.frame_idx)]);
  if (picture.colors.data.empty()) {
    return std::nullopt;
  }
  constexpr float kBehind = 0.6F;
  const float* gain = &model.static_gain[3 * camera];
  Image taken = linear_from_srgb(picture.colors);
  Image drawn = with_drawn_pixels(Image(taken.width, taken.height, 3, kBehind), view,
                                  shown.drawn.colors.drawn, first,
                                  Eigen::Vector3d(gain[0], gain[1], gain[2]));
  return TakenAndDrawn{std::move(taken), std::move(drawn)};
}

/// Calls with each view and the number of pixels in those before it.
template <typename Visit>
void visit_views(const ShownViews& shown, const Visit& visit) {
  std::size_t first = 0;
  for (const AppearanceView& view : shown.drawn.asked.views) {
    visit(view, first);
    first += view.pixel.size();
  }
}

}  // namespace

ShownViews shown_views(const fs::path& file, const AppearanceModel& model, const AvatarInput& input,
                       const DressedSubject& subject, Device device) {
  constexpr std::size_t kCameras = 5;
  constexpr std::size_t kFrames = 4;
  ShownViews shown;
  shown.which = spread(kCameras, input.cameras.size());
  std::vector<Camera> cameras;
  for (const std::size_t c : shown.which) {
    cameras.push_back(input.cameras[c]);
  }
  for (const std::size_t f : spread(kFrames, input.frame_ids.size())) {
    shown.frames.push_back(input.frame_ids[f]);
  }
  shown.drawn = drawn_views(file, model, subject, cameras, shown.frames, device);
  return shown;
}

std::vector<CaptionedImage> avatar_images(const ShownViews& shown, const AppearanceModel& model,
                                          const ReadPicture& read) {
  constexpr std::size_t kImages = 3;
  const std::vector<std::size_t> chosen = spread(kImages, shown.drawn.asked.views.size());
  std::vector<CaptionedImage> pairs;
  std::size_t at = 0;
  visit_views(shown, [&](const AppearanceView& view, std::size_t first) {
    if (std::count(chosen.begin(), chosen.end(), at++) == 0) {
      return;
    }
    if (auto pair = taken_and_drawn(shown, model, view, first, read)) {
      pairs.push_back({std::move(pair->taken), "taken"});
      pairs.push_back({std::move(pair->drawn), "drawn"});
    }
  });
  return pairs;
}

std::vector<CaptionedImage> avatar_crops(const ShownViews& shown, const AppearanceModel& model,
                                         const AvatarInput& input, const DressedSubject& subject,
                                         const ReadPicture& read) {
  constexpr int kSide = 512;
  const std::vector<Detail> details = details_of(input.person.model);
  if (details.empty()) {
    return {};
  }
  std::vector<CaptionedImage> pairs;
  std::size_t turn = 0;
  visit_views(shown, [&](const AppearanceView& view, std::size_t first) {
    const Camera& camera = input.cameras[shown.which[static_cast<std::size_t>(view.camera_idx)]];
    const int id = shown.frames[static_cast<std::size_t>(view.frame_idx)];
    const auto detail = shown_detail(details, turn++, subject.load(id)[0], view, camera);
    const auto pair = detail ? taken_and_drawn(shown, model, view, first, read) : std::nullopt;
    if (!pair) {
      return;
    }
    const std::string name =
        "frame " + std::to_string(id) + ", camera " + camera.id + ": " + detail->second;
    pairs.push_back({cut_out(pair->taken, detail->first, kSide), name + ", taken"});
    pairs.push_back({cut_out(pair->drawn, detail->first, kSide), "drawn"});
  });
  return pairs;
}

}  // namespace atelier
