#include "core/io/mesh_sequence_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "core/check_bounded.h"
#include "core/error.h"
#include "core/io/alembic.h"
#include "core/io/foreign_hdf5.h"
#include "core/io/lower_extension.h"
#include "core/io/npz.h"
#include "core/io/sequence_folder.h"
#include "core/io/usd_mesh.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/sequence_archive.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kArrays[] = {"vertices", "faces",  "uv",          "fps",          "frame_ids",
                                   "labels",   "joints", "joint_names", "joint_parents"};

/// The name of an array in a file that keeps body and cloth together: "body_vertices". Labels are
/// asked for by their own name alone, since theirs may count otherwise. "": there is none.
std::string name_beside(const std::string& name, SequenceOf what) {
  const bool own = name == "vertices" || name == "faces" || name == "uv";
  return own ? (what == SequenceOf::Cloth ? "cloth_" : "body_") + name : "";
}

std::map<std::string, Tensor> arrays_of(const fs::path& path, SequenceOf what,
                                        const Limits& limits) {
  std::map<std::string, std::string> wanted;  // by the name in the file
  const auto want = [&](const auto& has) {
    const bool alone = has("vertices");
    for (const char* name : kArrays) {
      const std::string beside = alone ? "" : name_beside(name, what);
      if (const std::string& there = beside.empty() ? name : beside; has(there)) {
        wanted[there] = name;
      }
    }
  };
  std::map<std::string, Tensor> arrays;
  if (lower_extension(path) == ".npz") {
    const Npz npz(path, limits);
    want([&](const std::string& name) { return npz.contains(name); });
    for (const auto& [there, name] : wanted) {
      arrays[name] = npz.read(there);
    }
    return arrays;
  }
  const ForeignHdf5Contents contents = foreign_hdf5_contents(path, limits);
  want([&](const std::string& name) { return contents.datasets.contains(name); });
  if (wanted.empty()) {
    return arrays;
  }
  std::vector<std::string> names;
  for (const auto& [there, name] : wanted) {
    names.push_back(there);
  }
  for (auto& [there, tensor] : read_foreign_hdf5(path, names, limits)) {
    arrays[wanted.at(there)] = std::move(tensor);
  }
  return arrays;
}

/// [F,R,3] of numbers that a mesh may have as F matrices.
std::vector<Points> frames_of(const Tensor& tensor, const std::string& file,
                              const std::string& name, const Limits& limits) {
  if (tensor.shape.size() != 3 || tensor.shape[2] != 3 || tensor.shape[0] < 1 ||
      tensor.shape[1] < 1 || tensor.shape[0] > limits.frames) {
    throw DataError(file, name, shape_text(tensor.shape), "[frames, rows, 3]");
  }
  check_bounded(tensor, limits.mesh_coordinate, file, name);
  const std::vector<double> values = doubles_of(tensor, file, name);
  std::vector<Points> frames;
  const auto rows = static_cast<Index>(tensor.shape[1]);
  for (std::int64_t f = 0; f < tensor.shape[0]; ++f) {
    frames.emplace_back(Eigen::Map<const Points>(values.data() + f * rows * 3, rows, 3));
  }
  return frames;
}

/// [N,3] of vertices, as whole numbers of any type.
Triangles triangles_of(const Tensor& tensor, Index vertices, const std::string& file) {
  const RowMatrix corners = matrix_of(tensor, 3, file, "faces");
  for (Index f = 0; f < corners.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const double corner = corners(f, k);
      if (!(corner >= 0 && corner < static_cast<double>(vertices) &&
            corner == std::floor(corner))) {
        throw DataError(file, "faces[" + std::to_string(f) + "," + std::to_string(k) + "]",
                        short_number(corner, 7), "a vertex, 0 to " + std::to_string(vertices - 1));
      }
    }
  }
  return corners.cast<int>();
}

/// The frames' own numbers, increasing; from 0 where the file has none.
std::vector<int> frame_ids_of(const std::map<std::string, Tensor>& arrays, std::size_t frames,
                              const std::string& file) {
  std::vector<int> ids;
  const auto said = arrays.find("frame_ids");
  if (said == arrays.end()) {
    ids.resize(frames);
    std::iota(ids.begin(), ids.end(), 0);
    return ids;
  }
  for (const std::int64_t id : integers_of(said->second, file, "frame_ids")) {
    if (id < 0 || id > std::numeric_limits<int>::max() || (!ids.empty() && id <= ids.back())) {
      throw DataError(file, "frame_ids", std::to_string(id) + " at " + std::to_string(ids.size()),
                      "numbers that increase, from 0 or more");
    }
    ids.push_back(static_cast<int>(id));
  }
  if (ids.size() != frames) {
    throw DataError(file, "frame_ids", counted(static_cast<std::int64_t>(ids.size()), "number"),
                    "one for each of " + counted(static_cast<std::int64_t>(frames), "frame"));
  }
  return ids;
}

/// A folder of meshes, one a frame. One that `export` wrote of a registered garment ("000012.ply")
/// has the garment's template beside them, which is no frame.
Sequence read_frames(const fs::path& folder, const Limits& limits,
                     const MeshConvention& otherwise) {
  std::map<int, fs::path> frames;
  bool has_template = false;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string extension = lower_extension(entry.path());
    if (extension != ".ply" && extension != ".obj") {
      continue;
    }
    const std::string name = entry.path().stem().string();
    if (name == "template") {
      has_template = true;
    } else if (name.size() != 6 || name.find_first_not_of("0123456789") != std::string::npos ||
               !frames.emplace(std::stoi(name), entry.path()).second) {
      return read_sequence_folder(folder, otherwise, limits);
    }
  }
  if (!has_template || frames.empty()) {
    return read_sequence_folder(folder, otherwise, limits);
  }
  auto files = std::make_shared<std::vector<Sequence>>();
  Sequence sequence;
  for (const auto& [frame_id, file] : frames) {
    sequence.frame_ids.push_back(frame_id);
    files->push_back(read_sequence_folder(file, otherwise, limits));
  }
  sequence.load = [files](Index i) { return frame((*files)[static_cast<std::size_t>(i)], 0); };
  return sequence;
}

}  // namespace

MeshSequenceFile mesh_sequence_of(const std::map<std::string, Tensor>& arrays,
                                  const std::string& file, const Limits& limits) {
  const auto need = [&](const char* name) -> const Tensor& {
    const auto found = arrays.find(name);
    if (found == arrays.end()) {
      throw DataError(file, name, "no such array", "vertices [F,V,3] and faces [N,3]");
    }
    return found->second;
  };
  MeshSequenceFile result;
  auto vertices =
      std::make_shared<std::vector<Points>>(frames_of(need("vertices"), file, "vertices", limits));
  const Index count = vertices->front().rows();
  result.shared.faces = triangles_of(need("faces"), count, file);
  if (const auto uv = arrays.find("uv"); uv != arrays.end()) {
    check_bounded(uv->second, limits.mesh_coordinate, file, "uv");
    result.shared.uvs = matrix_of(uv->second, 2, file, "uv");
    if (result.shared.uvs.rows() != count) {
      throw DataError(file, "uv", shape_text(uv->second.shape), "a row for each vertex");
    }
    result.shared.uv_faces = result.shared.faces;
  }
  if (const auto labels = arrays.find("labels"); labels != arrays.end()) {
    for (const std::int64_t label : integers_of(labels->second, file, "labels")) {
      if (label < 0 || label > 255) {
        throw DataError(file, "labels", std::to_string(label), "0 to 255");
      }
      result.shared.labels.push_back(static_cast<std::uint8_t>(label));
    }
  }
  double fps = 0;
  if (const auto rate = arrays.find("fps"); rate != arrays.end()) {
    const std::vector<double> values = doubles_of(rate->second, file, "fps");
    if (values.size() != 1 || !(values[0] > 0 && values[0] < 1e5)) {
      throw DataError(file, "fps", "no frame rate", "one number above 0");
    }
    fps = values[0];
  }
  if (const auto joints = arrays.find("joints"); joints != arrays.end()) {
    result.joints = frames_of(joints->second, file, "joints", limits);
    if (result.joints.size() != vertices->size()) {
      throw DataError(file, "joints",
                      counted(static_cast<std::int64_t>(result.joints.size()), "frame"),
                      std::to_string(vertices->size()));
    }
    const auto names = arrays.find("joint_names");
    const auto count_of_joints = result.joints.front().rows();
    if (names != arrays.end() &&
        (names->second.type != ElementType::Text ||
         static_cast<Index>(names->second.strings.size()) != count_of_joints)) {
      throw DataError(file, "joint_names", shape_text(names->second.shape),
                      "a name for each of " + counted(count_of_joints, "joint"));
    }
    for (Index j = 0; names == arrays.end() && j < count_of_joints; ++j) {
      result.names.push_back("joint_" + std::to_string(j));
    }
    result.names = names == arrays.end() ? result.names : names->second.strings;
    if (const auto parents = arrays.find("joint_parents"); parents != arrays.end()) {
      for (const std::int64_t parent : integers_of(parents->second, file, "joint_parents")) {
        result.parents.push_back(static_cast<int>(std::clamp<std::int64_t>(parent, -1, 1 << 20)));
      }
      if (result.parents.size() != result.names.size()) {
        throw DataError(
            file, "joint_parents",
            counted(static_cast<std::int64_t>(result.parents.size()), "number"),
            "one for each of " + counted(static_cast<std::int64_t>(result.names.size()), "joint"));
      }
    }
  }
  Mesh first = result.shared;
  first.vertices = vertices->front();
  check_mesh(first, file);
  result.sequence.fps = fps;
  result.sequence.frame_ids = frame_ids_of(arrays, vertices->size(), file);
  result.sequence.faces = result.shared.faces;
  result.sequence.load = [vertices, shared = result.shared](Index i) {
    Mesh mesh = shared;
    mesh.vertices = (*vertices)[static_cast<std::size_t>(i)];
    return mesh;
  };
  return result;
}

namespace {

/// Frames are the time codes where these are whole, else they count from 0.
MeshSequenceFile sequence_of_usd(UsdMesh usd, const std::string& file) {
  if (usd.frames.empty()) {
    throw DataError(file, "points", "no time samples", "points that move over time");
  }
  MeshSequenceFile result;
  result.shared = usd.mesh;
  result.sequence.fps = usd.fps;
  bool whole = true;
  for (const double time : usd.times) {
    whole = whole && time >= 0 && time < 1e9 && time == std::floor(time);
  }
  for (std::size_t f = 0; f < usd.times.size(); ++f) {
    result.sequence.frame_ids.push_back(
        static_cast<int>(whole ? usd.times[f] : static_cast<double>(f)));
  }
  result.sequence.faces = usd.mesh.faces;
  auto frames = std::make_shared<std::vector<Points>>(std::move(usd.frames));
  result.sequence.load = [frames, shared = result.shared](Index i) {
    Mesh mesh = shared;
    mesh.vertices = (*frames)[static_cast<std::size_t>(i)];
    return mesh;
  };
  return result;
}

}  // namespace

MeshSequenceFile read_mesh_sequence(const fs::path& path, SequenceOf what, const Limits& limits,
                                    const MeshConvention& otherwise) {
  MeshSequenceFile result;
  const std::string extension = lower_extension(path);
  if (extension == ".npz" || extension == ".h5" || extension == ".hdf5") {
    result = mesh_sequence_of(arrays_of(path, what, limits), path.string(), limits);
  } else if (has_usd_extension(path)) {
    result = sequence_of_usd(read_usd_mesh(path, limits), path.string());
  } else {
    refuse_alembic(path);
    result.sequence = fs::exists(path / "sequence.h5") ? open_sequence(path, limits)
                                                       : read_frames(path, limits, otherwise);
    result.shared = frame(result.sequence, 0);
    for (Index i = 1; i < frame_count(result.sequence) && result.sequence.faces.rows() == 0; ++i) {
      if (!equal_arrays(frame(result.sequence, i).faces, result.shared.faces)) {
        throw DataError(path.string(), "frame " + std::to_string(i), "another topology",
                        "one topology in all frames: a registration, not scans");
      }
    }
  }
  if (result.shared.faces.rows() == 0) {
    throw DataError(path.string(), "", "no faces", "a triangle mesh in every frame");
  }
  const Points first = frame(result.sequence, 0).vertices;
  const double height = first.col(1).maxCoeff() - first.col(1).minCoeff();
  if (what == SequenceOf::Person && !(height > 0.5 && height < 2.5)) {
    throw DataError(path.string(), "", std::to_string(height) + " tall along y",
                    "a person of 0.5 to 2.5 metres, Y up");
  }
  return result;
}

}  // namespace atelier
