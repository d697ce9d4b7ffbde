#include "core/io/usd_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/lower_extension.h"
#include "core/io/polygon_mesh.h"
#include "core/io/text_scanner.h"
#include "core/io/zip_archive.h"
#include "core/printable.h"

namespace atelier {
namespace {

using Numbers = std::vector<double>;

constexpr const char* kInstancer = "PointInstancer";

/// The numbers of an attribute at a time; linear between samples of one size, held beyond and
/// between others.
Numbers numbers_at(const UsdAttribute& attribute, double time) {
  const std::vector<double>& times = attribute.times;
  if (times.empty() || std::isnan(time)) {  // not a number: the default
    return attribute.has_value || times.empty() ? attribute.value.numbers
                                                : attribute.samples.front().numbers;
  }
  const auto after = std::upper_bound(times.begin(), times.end(), time);
  const auto next = static_cast<std::size_t>(after - times.begin());
  if (next == 0) {
    return attribute.samples.front().numbers;
  }
  const Numbers& from = attribute.samples[next - 1].numbers;
  if (next == times.size() || from.size() != attribute.samples[next].numbers.size()) {
    return from;
  }
  const Numbers& to = attribute.samples[next].numbers;
  const double share = (time - times[next - 1]) / (times[next] - times[next - 1]);
  Numbers result = from;
  for (std::size_t i = 0; share > 0 && i < result.size(); ++i) {
    result[i] += share * (to[i] - from[i]);
  }
  return result;
}

class MeshBuilder {
 public:
  MeshBuilder(const UsdStage& stage, const std::string& file, const Limits& limits)
      : stage_(stage), file_(file), limits_(limits) {}

  UsdMesh build() {
    UsdMesh result;
    result.fps = stage_.fps;
    find_meshes(result.findings);
    const double none = std::nan("");
    PolygonMesh polygons = polygons_at(none);
    const MeshConvention said{stage_.metres_per_unit, stage_.up};
    result.mesh = in_metres_y_up(triangulated(polygons), said, said);
    check_mesh(result.mesh, file_);
    check_size(result.mesh);
    result.times = times();
    if (std::cmp_greater(result.times.size(), limits_.frames) ||
        static_cast<double>(result.times.size()) *
                static_cast<double>(result.mesh.vertices.size()) >
            static_cast<double>(limits_.tensor_bytes) / 8) {
      throw DataError(file_, "times", counted(std::ssize(result.times), "frame"),
                      "what the limits allow: fewer frames or smaller meshes");
    }
    for (const double time : result.times) {
      polygons.vertices = points_at(time);
      Mesh frame;
      frame.vertices = polygons.vertices;
      result.frames.push_back(in_metres_y_up(std::move(frame), said, said).vertices);
      if (!result.frames.back().allFinite()) {
        throw DataError(file_, "points", "a number that is not finite", "finite numbers");
      }
    }
    return result;
  }

 private:
  [[noreturn]] void refuse(const UsdPrim& prim, const std::string& found,
                           const std::string& expected) const {
    throw DataError(file_, "prim " + prim.name, found, expected);
  }

  const UsdAttribute* attribute(const UsdPrim& prim, const std::string& name) const {
    const auto found = prim.attributes.find(name);
    return found == prim.attributes.end() ? nullptr : &found->second;
  }

  std::string word(const UsdPrim& prim, const std::string& name) const {
    const UsdAttribute* found = attribute(prim, name);
    return found == nullptr || found->value.texts.empty() ? "" : found->value.texts.front();
  }

  bool has_numbers(const UsdPrim& prim, const std::string& name) const {
    const UsdAttribute* found = attribute(prim, name);
    if (found == nullptr) {
      return false;
    }
    const bool sampled = !found->has_value && !found->samples.empty();
    return !(sampled ? found->samples.front() : found->value).numbers.empty();
  }

  /// What stands elsewhere than the points say, once a skeleton or an instancer has placed it.
  void add_unposed(std::int64_t instancers, std::vector<Finding>& findings) const {
    const auto skinned = std::count_if(meshes_.begin(), meshes_.end(),
                                       [&](std::size_t p) { return stage_.prims[p].skinned; });
    if (skinned > 0) {
      findings.push_back({Severity::Warning, "usd-skin", file_,
                          counted(skinned, "Mesh prim") +
                              " with a skeleton: the points are those before skinning, and the "
                              "skeleton's pose and animation are not applied",
                          "export the posed meshes, or body and motion as glTF or FBX"});
    }
    if (instancers > 0) {
      findings.push_back({Severity::Warning, "usd-instances", file_,
                          counted(instancers, "PointInstancer") + ", left out with what it repeats",
                          "write the instances as meshes"});
    }
  }

  void find_meshes(std::vector<Finding>& findings) {
    std::vector<char> hidden(stage_.prims.size(), 0);
    std::int64_t refers = stage_.sublayers ? 1 : 0;
    std::int64_t instancers = 0;
    std::int64_t empty = 0;
    for (std::size_t p = 0; p < stage_.prims.size(); ++p) {
      const UsdPrim& prim = stage_.prims[p];
      const std::string purpose = word(prim, "purpose");
      const bool above = prim.parent >= 0 && hidden[static_cast<std::size_t>(prim.parent)] != 0;
      hidden[p] =
          static_cast<char>(above || !prim.defined || word(prim, "visibility") == "invisible" ||
                            purpose == "guide" || purpose == "proxy" || prim.type == kInstancer);
      instancers += prim.type == kInstancer && !above ? 1 : 0;
      refers += prim.refers ? 1 : 0;
      if (prim.type == "Mesh" && hidden[p] == 0) {
        const bool filled = has_numbers(prim, "points") && has_numbers(prim, "faceVertexIndices");
        empty += filled ? 0 : 1;
        if (filled) {
          meshes_.push_back(p);
        }
      }
    }
    if (empty > 0 && !meshes_.empty()) {
      findings.push_back({Severity::Note, "usd-empty", file_,
                          counted(empty, "Mesh prim") + " without points or faces",
                          "they were left out"});
    }
    if (meshes_.empty()) {
      throw DataError(file_, "prims",
                      empty > 0    ? "no mesh that has points and faces"
                      : refers > 0 ? "no mesh, and references to others"
                                   : "no mesh",
                      "a Mesh that is defined and to be seen in this file; usdcat --flatten puts "
                      "what it refers to into it");
    }
    if (refers > 0) {
      findings.push_back({Severity::Warning, "usd-references", file_,
                          "references to other layers, variants or prims, which are not followed",
                          "usdcat --flatten FILE -o FLAT.usdc puts them into one file"});
    }
    add_unposed(instancers, findings);
  }

  /// One operation of a place: column vectors, where USD has rows.
  Eigen::Matrix4d operation(const UsdPrim& prim, std::string name, double time) const {
    constexpr std::string_view kInvert = "!invert!";
    const bool inverted = name.starts_with(kInvert);
    name = inverted ? name.substr(kInvert.size()) : name;
    const UsdAttribute* found = attribute(prim, name);
    if (found == nullptr) {
      refuse(prim, "no " + name + ", which xformOpOrder names", "the attribute");
    }
    const Numbers numbers = numbers_at(*found, time);
    const std::size_t colon = name.find(':');
    const std::string kind = name.substr(colon + 1, name.find(':', colon + 1) - colon - 1);
    const auto need = [&](std::size_t count) {
      if (numbers.size() != count) {
        refuse(prim, name + " of " + counted(std::ssize(numbers), "number"), std::to_string(count));
      }
    };
    Eigen::Affine3d transform = Eigen::Affine3d::Identity();
    constexpr double kRadians = std::numbers::pi / 180;
    if (kind == "transform") {
      need(16);
      transform.matrix() = Eigen::Map<const Eigen::Matrix4d>(numbers.data());
    } else if (kind == "translate" || kind == "scale") {
      need(3);
      const Eigen::Vector3d vector(numbers[0], numbers[1], numbers[2]);
      transform = kind == "scale" ? Eigen::Affine3d(Eigen::Scaling(vector))
                                  : Eigen::Affine3d(Eigen::Translation3d(vector));
    } else if (kind == "orient") {
      need(4);
      transform = Eigen::Quaterniond(numbers[3], numbers[0], numbers[1], numbers[2]).normalized();
    } else if (kind.starts_with("rotate") && kind.size() >= 7 && kind.size() <= 9) {
      const std::string axes = kind.substr(6);
      need(axes.size() == 1 ? 1 : 3);
      for (const char axis : axes) {
        const int a = axis - 'X';
        if (a < 0 || a > 2) {
          refuse(prim, name, "a rotation about X, Y or Z");
        }
        const double angle = numbers[axes.size() == 1 ? 0 : static_cast<std::size_t>(a)];
        transform = Eigen::AngleAxisd(kRadians * angle, Eigen::Vector3d::Unit(a)) * transform;
      }
    } else {
      refuse(prim, "the operation " + name, "transform, translate, scale, orient or a rotation");
    }
    return inverted ? Eigen::Matrix4d(transform.matrix().inverse()) : transform.matrix();
  }

  /// World from prim.
  Eigen::Matrix4d place(std::size_t p, double time) const {
    Eigen::Matrix4d world = Eigen::Matrix4d::Identity();
    for (int at = static_cast<int>(p); at >= 0;
         at = stage_.prims[static_cast<std::size_t>(at)].parent) {
      const UsdPrim& prim = stage_.prims[static_cast<std::size_t>(at)];
      Eigen::Matrix4d local = Eigen::Matrix4d::Identity();
      const UsdAttribute* order = attribute(prim, "xformOpOrder");
      bool alone = false;
      for (const std::string& name :
           order == nullptr ? std::vector<std::string>() : order->value.texts) {
        if (name == "!resetXformStack!") {
          alone = true;
          local.setIdentity();
        } else {
          local = local * operation(prim, name, time);
        }
      }
      world = local * world;
      if (alone) {
        break;
      }
    }
    return world;
  }

  std::vector<double> times() const {
    std::set<double> all;
    for (const std::size_t mesh : meshes_) {
      for (int p = static_cast<int>(mesh); p >= 0;
           p = stage_.prims[static_cast<std::size_t>(p)].parent) {
        for (const auto& [name, attribute] : stage_.prims[static_cast<std::size_t>(p)].attributes) {
          if (name == "points" || name.starts_with("xformOp:")) {
            all.insert(attribute.times.begin(), attribute.times.end());
          }
        }
      }
    }
    return {all.begin(), all.end()};
  }

  Points points_of(std::size_t p, double time) const {
    const UsdPrim& prim = stage_.prims[p];
    const UsdAttribute* found = attribute(prim, "points");
    const Numbers numbers = found == nullptr ? Numbers() : numbers_at(*found, time);
    if (numbers.empty() || numbers.size() % 3 != 0) {
      refuse(prim, "points of " + counted(std::ssize(numbers), "number"), "three a point");
    }
    Points points = Eigen::Map<const Points>(numbers.data(), std::ssize(numbers) / 3, 3);
    if (!points.allFinite()) {
      refuse(prim, "a point that is not finite", "finite numbers");
    }
    const Eigen::Matrix4d world = place(p, time);
    points = (points * world.topLeftCorner<3, 3>().transpose()).rowwise() +
             world.topRightCorner<3, 1>().transpose();
    return points;
  }

  Points points_at(double time) const {
    Points all(count_, 3);
    Index row = 0;
    for (const std::size_t p : meshes_) {
      const Points points = points_of(p, time);
      if (row + points.rows() > count_) {
        refuse(stage_.prims[p], "another number of points over time", "one mesh in all frames");
      }
      all.middleRows(row, points.rows()) = points;
      row += points.rows();
    }
    if (row != count_) {
      throw DataError(file_, "points", "another number of points over time",
                      "one mesh in all frames");
    }
    return all;
  }

  std::vector<int> whole(const UsdPrim& prim, const std::string& name, std::int64_t most) const {
    const UsdAttribute* found = attribute(prim, name);
    if (found != nullptr && found->samples.size() > 1 &&
        std::any_of(found->samples.begin(), found->samples.end(), [&](const UsdValue& one) {
          return one.numbers != found->samples.front().numbers;
        })) {
      refuse(prim, name + " that change over time", "one mesh in all frames");
    }
    std::vector<int> values;
    for (const double number : found == nullptr ? Numbers() : numbers_at(*found, std::nan(""))) {
      if (!(number >= 0 && number < static_cast<double>(most))) {
        refuse(prim, "a number in " + name + " outside of 0 to " + std::to_string(most - 1),
               "one of the mesh");
      }
      values.push_back(static_cast<int>(number));
    }
    return values;
  }

  /// Texture coordinates, a corner each; false where a mesh has none.
  bool add_uvs(const UsdPrim& prim, const std::vector<int>& corners, PolygonMesh& all) const {
    std::string name = "primvars:st";
    for (const auto& [other, values] : prim.attributes) {
      if (!prim.attributes.contains(name) && other.starts_with("primvars:") &&
          !other.ends_with(":indices")) {
        name = other;
      }
    }
    const UsdAttribute* found = attribute(prim, name);
    const Numbers numbers = found == nullptr ? Numbers() : numbers_at(*found, std::nan(""));
    if (numbers.empty() || numbers.size() % 2 != 0) {
      return false;
    }
    const Index count = std::ssize(numbers) / 2;
    const std::vector<int> indices = whole(prim, name + ":indices", count);
    const bool by_vertex = found->interpolation == "vertex" || found->interpolation == "varying";
    const auto first = static_cast<int>(all.uvs.rows());
    for (std::size_t c = 0; c < corners.size(); ++c) {
      const std::size_t element = by_vertex ? static_cast<std::size_t>(corners[c]) : c;
      const std::size_t place = indices.empty() ? element
                                : element < indices.size()
                                    ? static_cast<std::size_t>(indices[element])
                                    : static_cast<std::size_t>(count);
      if (std::cmp_greater_equal(place, count)) {
        return false;
      }
      all.corner_uvs.push_back(first + static_cast<int>(place));
    }
    all.uvs.conservativeResize(first + count, 2);
    all.uvs.bottomRows(count) = Eigen::Map<const Points2>(numbers.data(), count, 2);
    return all.uvs.allFinite();
  }

  PolygonMesh polygons_at(double time) {
    PolygonMesh all;
    bool uvs = true;
    for (const std::size_t p : meshes_) {
      const UsdPrim& prim = stage_.prims[p];
      const Points points = points_of(p, time);
      const std::vector<int> counts = whole(prim, "faceVertexCounts", std::int64_t{1} << 20);
      std::vector<int> corners = whole(prim, "faceVertexIndices", points.rows());
      const bool left = word(prim, "orientation") == "leftHanded";
      uvs = uvs && add_uvs(prim, corners, all);
      const auto first_vertex = static_cast<int>(all.vertices.rows());
      const std::size_t first_corner = all.corner_vertices.size();
      std::size_t at = 0;
      for (const int count : counts) {
        const std::size_t end = at + static_cast<std::size_t>(count);
        if (count < 3 || end > corners.size()) {
          refuse(prim, "a face of " + counted(count, "corner"), "3 or more, in faceVertexIndices");
        }
        if (left) {
          std::reverse(corners.begin() + static_cast<std::ptrdiff_t>(at),
                       corners.begin() + static_cast<std::ptrdiff_t>(end));
          if (uvs) {
            const auto uv = all.corner_uvs.begin() + static_cast<std::ptrdiff_t>(first_corner);
            std::reverse(uv + static_cast<std::ptrdiff_t>(at),
                         uv + static_cast<std::ptrdiff_t>(end));
          }
        }
        at = end;
        all.polygon_starts.push_back(static_cast<int>(first_corner + at));
      }
      if (at != corners.size() || corners.empty()) {
        refuse(prim, counted(std::ssize(corners), "corner"),
               "as many as faceVertexCounts says, and a face");
      }
      for (const int corner : corners) {
        all.corner_vertices.push_back(first_vertex + corner);
      }
      all.vertices.conservativeResize(first_vertex + points.rows(), 3);
      all.vertices.bottomRows(points.rows()) = points;
      if (std::cmp_greater(all.vertices.rows(), limits_.mesh_vertices) ||
          std::cmp_greater(all.corner_vertices.size(), 3 * limits_.mesh_faces)) {
        refuse(prim, "more vertices or faces than the limits allow", "smaller meshes");
      }
    }
    if (!uvs) {
      all.uvs.resize(0, 2);
      all.corner_uvs.clear();
    }
    count_ = all.vertices.rows();
    return all;
  }

  void check_size(const Mesh& mesh) const {
    if (!(mesh.vertices.cwiseAbs().maxCoeff() <= limits_.mesh_coordinate)) {
      throw DataError(file_, "points", "a coordinate beyond the limits", "metres of a person");
    }
  }

  const UsdStage& stage_;
  const std::string& file_;
  const Limits& limits_;
  std::vector<std::size_t> meshes_;
  Index count_ = 0;
};

/// The layer that a package begins with.
std::vector<std::byte> first_layer(const std::filesystem::path& path, const Limits& limits) {
  const ZipArchive package(path, limits);
  if (package.names().empty()) {
    throw DataError(path.string(), "", "an empty package", "a layer of USD");
  }
  return package.read(package.names().front(), limits.mesh_file_bytes);
}

}  // namespace

UsdMesh usd_mesh(const UsdStage& stage, const std::string& file, const Limits& limits) {
  return MeshBuilder(stage, file, limits).build();
}

bool has_usd_extension(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".usd" || extension == ".usda" || extension == ".usdc" ||
         extension == ".usdz";
}

UsdMesh read_usd_mesh(const std::filesystem::path& path, const Limits& limits) {
  const std::vector<std::byte> bytes = lower_extension(path) == ".usdz"
                                           ? first_layer(path, limits)
                                           : read_file_bytes(path, limits.mesh_file_bytes);
  constexpr std::string_view kText = "#usda";
  const UsdStage stage = as_text(bytes).starts_with(kText)
                             ? read_usda_stage(as_text(bytes), path.string(), limits)
                             : read_usd_crate(bytes, path.string(), limits);
  return usd_mesh(stage, path.string(), limits);
}

}  // namespace atelier
