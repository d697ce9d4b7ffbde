#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "bodymodel/formats/motion_amass.h"
#include "bodymodel/formats/smpl.h"
#include "core/io/npz.h"
#include "core/random.h"
#include "core/tensor.h"

namespace atelier::fixtures {

using Arrays = std::map<std::string, Tensor>;

inline constexpr std::int64_t kVertices = 30;

template <class T = float>
Tensor random_tensor(Random& random, std::vector<std::int64_t> shape, double scale) {
  std::int64_t count = 1;
  for (const std::int64_t n : shape) {
    count *= n;
  }
  std::vector<T> values(static_cast<std::size_t>(count));
  for (T& value : values) {
    value = static_cast<T>(scale * normal(random));
  }
  return tensor_of<T>(values, std::move(shape));
}

inline Tensor table_of(const std::vector<int>& parents) {
  std::vector<std::uint32_t> values;
  for (const int parent : parents) {
    values.push_back(parent < 0 ? 4'294'967'295u : static_cast<std::uint32_t>(parent));
  }
  for (std::size_t j = 0; j < parents.size(); ++j) {
    values.push_back(static_cast<std::uint32_t>(j));
  }
  return tensor_of<std::uint32_t>(values, {2, static_cast<std::int64_t>(parents.size())});
}

// A tiny file with the structure of one of the family: 30 vertices instead of thousands.
inline Arrays smpl_arrays(std::int64_t joints, std::int64_t shapes, bool star = false) {
  Random random{5};
  Arrays arrays;
  arrays["v_template"] = random_tensor(random, {kVertices, 3}, 0.3);
  std::vector<std::uint32_t> faces;
  for (std::uint32_t f = 0; f + 2 < kVertices; ++f) {
    faces.insert(faces.end(), {f, f + 1, f + 2});
  }
  arrays["f"] = tensor_of<std::uint32_t>(faces, {kVertices - 2, 3});
  arrays["shapedirs"] = random_tensor(random, {kVertices, 3, shapes}, 0.02);
  arrays["posedirs"] =
      random_tensor(random, {kVertices, 3, star ? 4 * (joints - 1) + 1 : 9 * (joints - 1)}, 0.01);
  std::vector<float> regressor(static_cast<std::size_t>(joints * kVertices), 0);
  std::vector<float> weights(static_cast<std::size_t>(joints * kVertices), 0);
  for (std::int64_t j = 0; j < joints; ++j) {
    regressor[static_cast<std::size_t>(j * kVertices + j % kVertices)] = 0.75f;
    regressor[static_cast<std::size_t>(j * kVertices + (j + 7) % kVertices)] = 0.25f;
  }
  for (std::int64_t v = 0; v < kVertices; ++v) {
    weights[static_cast<std::size_t>(v * joints + v % joints)] = 0.6f;
    weights[static_cast<std::size_t>(v * joints + (v + 3) % joints)] = 0.4f;
  }
  arrays["J_regressor"] = tensor_of<float>(regressor, {joints, kVertices});
  arrays["weights"] = tensor_of<float>(weights, {kVertices, joints});
  arrays["kintree_table"] = table_of(smpl_parents(joints));
  return arrays;
}

inline Tensor zeros(std::vector<std::int64_t> shape) {
  std::int64_t count = 1;
  for (const std::int64_t n : shape) {
    count *= n;
  }
  return tensor_of<float>(std::vector<float>(static_cast<std::size_t>(count)), std::move(shape));
}

inline float* floats(Tensor& tensor) {
  return reinterpret_cast<float*>(tensor.data.data());
}

inline Arrays amass_arrays(std::int64_t columns = 156) {
  Random random{6};
  Arrays arrays;
  arrays["poses"] = random_tensor<double>(random, {4, columns}, 0.4);
  arrays["trans"] = random_tensor<double>(random, {4, 3}, 1);
  arrays["betas"] = random_tensor<double>(random, {16}, 1);
  arrays["mocap_framerate"] = tensor_of<double>(std::vector<double>{120}, {});
  return arrays;
}

inline MotionClip read_amass_arrays(const Arrays& arrays, const BodyModel* model = nullptr) {
  return read_amass(Npz(npz_bytes(arrays), "walk_poses.npz"), model, {}, {.up = 'z'});
}

inline const Finding* finding_of(const MotionClip& clip, const std::string& code) {
  const auto found = std::find_if(clip.findings.begin(), clip.findings.end(),
                                  [&](const Finding& finding) { return finding.code == code; });
  return found == clip.findings.end() ? nullptr : &*found;
}

inline Tensor tensor_of_rows(const RowMatrix& matrix) {
  return tensor_of<double>(std::vector<double>(matrix.data(), matrix.data() + matrix.size()),
                           {matrix.rows(), matrix.cols()});
}

// The tiny body in a T-pose, as the family's are: level arms.
inline BodyModel t_posed(std::int64_t joints, std::int64_t shapes) {
  BodyModel model = read_smpl(Npz(npz_bytes(smpl_arrays(joints, shapes)), "body.npz")).model;
  for (const char* name : {"left_elbow", "left_wrist", "right_elbow", "right_wrist"}) {
    model.skeleton.offsets.row(find_joint(model.skeleton, name)) << 0.3, 0, 0;
  }
  return model;
}

}  // namespace atelier::fixtures
