#include "appearance/network/code_frames.h"

#include <algorithm>

#include "appearance/encoded_frames.h"
#include "appearance/network/device_memory.h"
#include "appearance/texel_map.h"
#include "core/error.h"
#include "core/topology.h"

namespace atelier {
namespace {

void add_offsets(CodeFrames& code, const AppearanceData& data, torch::Device device) {
  if (!data.body) {
    throw DataError("", "appearance data", "no surface but the mean one",
                    "the offsets of each frame, which geometry is learnt from");
  }
  std::vector<torch::Tensor> offsets;
  std::vector<torch::Tensor> supports;
  for (std::size_t f = 0; f < data.frames.size(); ++f) {
    const FloatRows& offset = data.body->offset[f];
    const Eigen::VectorXf& support = data.body->support[f];
    offsets.push_back(on_device(offset.data(), {1, offset.rows(), 3}, device));
    supports.push_back(on_device(support.data(), {1, support.rows(), 1}, device));
  }
  code.offset = torch::cat(offsets, 0);
  code.support = torch::cat(supports, 0);
  const Topology topology = topology_of(data.faces, data.frames[0].position.rows());
  std::vector<std::int64_t> begins;
  std::vector<std::int64_t> ends;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    begins.push_back(topology.edges(e, 0));
    ends.push_back(topology.edges(e, 1));
  }
  code.begins = rows_on_device(begins, device);
  code.ends = rows_on_device(ends, device);
}

}  // namespace

CodeFrames code_frames(const AppearanceModel& model, const AppearanceData& data,
                       torch::Device device) {
  const std::vector<Image> encoded = encoded_frames(data, model);
  std::vector<torch::Tensor> poses;
  std::vector<torch::Tensor> seen;
  for (std::size_t f = 0; f < data.frames.size(); ++f) {
    const std::vector<float> pose =
        model.parts ? pose_code(*model.parts, data.frames[f].position, data.frames[f].face)
                    : std::vector<float>();
    poses.push_back(on_device(pose.data(), {1, static_cast<std::int64_t>(pose.size())}, device));
    const Image& image = encoded[f];
    seen.push_back(
        on_device(image.data.data(), {1, image.height, image.width, kEncodedChannels}, device)
            .permute({0, 3, 1, 2}));
  }
  CodeFrames code;
  code.pose = torch::cat(poses, 0);
  code.encoded = torch::cat(seen, 0).contiguous();
  if (model.options.geometry) {
    add_offsets(code, data, device);
  }
  return code;
}

void place_code(Layers& layers, const AppearanceModel& model, torch::Device device) {
  const int side = code_resolution_of(model.options);
  if (model.parts) {
    constexpr int kReach = 4;
    const TexelMap map = texel_map(model.faces, model.uvs, model.uv_faces, side, kReach);
    const Image masks =
        texture_of(map, texel_values(map, model.faces, pose_masks(*model.parts, model.faces)));
    layers.pose_masks = on_device(masks.data.data(), {1, side, side, masks.channels}, device)
                            .permute({0, 3, 1, 2})
                            .repeat_interleave(3, 1)
                            .contiguous();
  }
  std::vector<float> u;
  std::vector<float> v;
  for (Index i = 0; i < model.uvs.rows(); ++i) {
    u.push_back(static_cast<float>(model.uvs(i, 0)));
    v.push_back(static_cast<float>(model.uvs(i, 1)));
  }
  // A place that no face names is none of any vertex, which a row more stands for.
  const Index vertices = model.mean_transfer.rows();
  std::vector<std::int64_t> vertex(u.size(), vertices);
  for (Index f = 0; f < model.faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k) {
      vertex[static_cast<std::size_t>(model.uv_faces(f, k))] = model.faces(f, k);
    }
  }
  std::vector<float> counts(static_cast<std::size_t>(vertices) + 1, 0.0F);
  for (const std::int64_t of : vertex) {
    counts[static_cast<std::size_t>(of)] += 1;
  }
  for (float& count : counts) {
    count = std::max(count, 1.0F);
  }
  layers.uv_grid = sampling_grid(u, v, device);
  layers.uv_vertices = rows_on_device(vertex, device);
  layers.uv_counts =
      on_device(counts.data(), {static_cast<std::int64_t>(counts.size()), 1}, device);
}

torch::Tensor offset_loss(const CodeFrames& code, const CodeLosses& losses,
                          const torch::Tensor& offsets, const torch::Tensor& frames) {
  constexpr double kUnit = 0.005;    // m
  constexpr double kUnknown = 0.01;  // with which what nothing supports keeps to the mean surface
  const torch::Tensor support = code.support.index_select(0, frames) + kUnknown;
  const torch::Tensor off = (offsets - code.offset.index_select(0, frames)) / kUnit;
  const torch::Tensor bend = off.index_select(1, code.begins) - off.index_select(1, code.ends);
  const torch::Tensor known =
      torch::minimum(support.index_select(1, code.begins), support.index_select(1, code.ends));
  return losses.geometry * (off.pow(2) * support).sum() / support.sum() +
         losses.bending * (bend.pow(2) * known).sum() / known.sum();
}

}  // namespace atelier
