// Shows what networks draw: appearance_pictures CAPTURE WORKSPACE appearance|oracle PICTURE.png.
// One row for each of the first and the last held-out frame, seen by the first held-out camera: the
// image without noise, the same with every surface that has a network drawn by it, with the
// texture that does not change, and four times the difference of the first two.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "appearance/network/network.h"
#include "capture/capture_info.h"
#include "core/io/image_file.h"
#include "core/io/safetensors.h"
#include "core/render/contact_sheet.h"
#include "pipeline/outfit/worn_subject.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// The part of an image where the surface is, with room round it.
struct Crop {
  int x0, y0, x1, y1;
};

Image cropped(const Image& image, const Crop& crop) {
  Image part(crop.x1 - crop.x0, crop.y1 - crop.y0, 3);
  for (int y = 0; y < part.height; ++y) {
    for (int x = 0; x < part.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        part.at(x, y, c) = image.at(crop.x0 + x, crop.y0 + y, c);
      }
    }
  }
  return part;
}

void make(const fs::path& capture, const fs::path& workspace, const std::string& stage,
          const fs::path& out) {
  const CaptureInfo info = read_capture_info(capture);
  const auto truth_of_all = std::make_shared<const GroundTruth>(read_ground_truth(capture));
  const WornSubject dressed =
      stage == "oracle"
          ? worn_in_truth(capture, truth_of_all)
          : worn_in_workspace(workspace / "register" / "current", workspace / "body" / "current");
  Camera camera;
  for (const Camera& one : truth_of_all->cameras) {
    camera = one.id == info.held_out_cameras.front() ? one : camera;
  }
  std::vector<CaptionedImage> pictures;
  for (const int frame_id : {info.held_out_frames.front(), info.held_out_frames.back()}) {
    const Image truth =
        read_image(capture / "truth" / "images" / camera.id / (frame_name(frame_id) + ".png"));
    Image drawn = truth;
    Image fixed = truth;
    Crop crop{truth.width, truth.height, 0, 0};
    for (std::size_t which = 0; which < dressed.templates.size(); ++which) {
      const fs::path file =
          workspace / stage / "current" / dressed.subject.names[which] / "model.safetensors";
      if (!fs::exists(file)) {
        continue;
      }
      const Safetensors found = read_safetensors(file);
      const AppearanceModel model = appearance_model_of(found.tensors, found.metadata);
      DrawnSurface surface;
      surface.which = which;
      surface.atlas = {model.uvs, model.uv_faces, {}};
      surface.trusted_only = false;
      const AppearanceData data =
          prepare_appearance(dressed.subject, surface, {{camera}, {frame_id}});
      Eigen::Array3d middle = Eigen::Array3d::Zero();
      for (const Camera& one : truth_of_all->cameras) {
        if (std::count(model.camera_ids.begin(), model.camera_ids.end(), one.id) > 0) {
          middle += one.gain.array().log() / static_cast<double>(model.camera_ids.size());
        }
      }
      const Eigen::Array3d gain = camera.gain.array() / middle.exp();
      const TexturePixels pixels{data.views[0].u, data.views[0].v, {}};
      const std::vector<float> colors = AppearanceNetwork(model, Device::Cpu)
                                            .colors(data.frames[0], camera_center(camera), pixels);
      const std::vector<float> still = sample_texture(model.static_texture, pixels);
      for (std::size_t i = 0; i < data.views[0].pixel.size(); ++i) {
        const int place = data.views[0].pixel[i];
        for (int c = 0; c < 3; ++c) {
          drawn.data[3 * place + c] =
              std::clamp(static_cast<float>(colors[3 * i + c] * gain[c]), 0.0F, 1.0F);
          fixed.data[3 * place + c] =
              std::clamp(static_cast<float>(still[3 * i + c] * gain[c]), 0.0F, 1.0F);
        }
        crop = {std::min(crop.x0, place % truth.width), std::min(crop.y0, place / truth.width),
                std::max(crop.x1, place % truth.width + 1),
                std::max(crop.y1, place / truth.width + 1)};
      }
    }
    constexpr int kRoom = 10;
    crop = {std::max(0, crop.x0 - kRoom), std::max(0, crop.y0 - kRoom),
            std::min(truth.width, crop.x1 + kRoom), std::min(truth.height, crop.y1 + kRoom)};
    Image difference = truth;
    for (std::size_t i = 0; i < truth.data.size(); ++i) {
      difference.data[i] = std::min(1.0F, 4 * std::abs(truth.data[i] - drawn.data[i]));
    }
    const std::string frame = "frame " + std::to_string(frame_id);
    pictures.push_back({cropped(truth, crop), frame + ", true"});
    pictures.push_back({cropped(drawn, crop), "network"});
    pictures.push_back({cropped(fixed, crop), "static texture"});
    pictures.push_back({cropped(difference, crop), "difference x 4"});
  }
  ContactSheetOptions options;
  options.columns = 4;
  write_image(out, contact_sheet(pictures, options));
}

}  // namespace
}  // namespace atelier

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "appearance_pictures CAPTURE WORKSPACE appearance|oracle PICTURE.png\n");
    return 2;
  }
  atelier::make(argv[1], argv[2], argv[3], argv[4]);
}
