#include "core/io/fbx_mesh.h"

#ifdef ATELIER_HAS_ASSIMP

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <bit>
#include <cmath>
#include <cstdint>
#include <set>
#include <unordered_set>
#include <utility>

#include <assimp/mesh.h>

#include "core/error.h"
#include "core/io/polygon_mesh.h"
#include "core/io/text_scanner.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr std::size_t kMaxInfluences = 256;  // 64 sets of JOINTS_n

struct Influence {
  int joint;
  float weight;
  bool operator==(const Influence&) const = default;
};

Eigen::Vector3d vector_of(const aiVector3D& v) {
  return {v.x, v.y, v.z};
}

/// The corners of a mesh as libassimp lists them, each a vertex of its own, and which are the same.
class FbxCorners {
 public:
  FbxCorners(const aiMesh& mesh, const std::vector<int>& joint_of_bone, const std::string& name)
      : mesh_(mesh), where_("mesh " + in_quotes(mesh.mName.C_Str())), file_(name) {
    check(mesh.mVertices, "a position");
    check(mesh.mNormals, "a normal");
    check(mesh.mTextureCoords[0], "a texture coordinate");
    for (unsigned t = 0; t < mesh.mNumAnimMeshes; ++t) {
      if (mesh.mAnimMeshes[t]->mNumVertices != mesh.mNumVertices) {
        fail("a blend shape of " + std::to_string(mesh.mAnimMeshes[t]->mNumVertices) + " vertices",
             std::to_string(mesh.mNumVertices));
      }
      check(mesh.mAnimMeshes[t]->mVertices, "a blend shape");
    }
    if (!joint_of_bone.empty()) {
      read_influences(joint_of_bone);
    }
  }

  const std::vector<Influence>& influences(unsigned corner) const { return influences_[corner]; }
  bool skinned() const { return !influences_.empty(); }

  bool same(unsigned a, unsigned b) const {
    const auto agree = [a, b](const aiVector3D* rows) {
      return rows == nullptr ||
             (rows[a].x == rows[b].x && rows[a].y == rows[b].y && rows[a].z == rows[b].z);
    };
    bool all = agree(mesh_.mVertices) && agree(mesh_.mTextureCoords[0]) &&
               (skinned() ? influences_[a] == influences_[b] : agree(mesh_.mNormals));
    for (unsigned t = 0; all && t < mesh_.mNumAnimMeshes; ++t) {
      all = agree(mesh_.mAnimMeshes[t]->mVertices);
    }
    return all;
  }

  std::size_t hash(unsigned corner) const {
    std::uint64_t sum = 0xCBF29CE484222325;  // FNV-1a, by numbers instead of bytes
    const auto add = [&sum](const aiVector3D* rows, unsigned row) {
      for (const float x : {rows[row].x, rows[row].y, rows[row].z}) {
        sum = (sum ^ std::bit_cast<std::uint32_t>(x + 0.0f)) * 0x100000001B3;  // -0 as 0
      }
    };
    add(mesh_.mVertices, corner);
    if (mesh_.mTextureCoords[0] != nullptr) {
      add(mesh_.mTextureCoords[0], corner);
    }
    return sum;
  }

  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw DataError(file_, where_, found, expected);
  }

 private:
  void check(const aiVector3D* rows, const char* what) const {
    for (unsigned i = 0; rows != nullptr && i < mesh_.mNumVertices; ++i) {
      if (!vector_of(rows[i]).allFinite()) {
        fail(std::string(what) + " that is not finite", "numbers");
      }
    }
  }

  void read_influences(const std::vector<int>& joint_of_bone) {
    influences_.resize(mesh_.mNumVertices);
    for (unsigned b = 0; b < mesh_.mNumBones; ++b) {
      const aiBone& bone = *mesh_.mBones[b];
      for (unsigned k = 0; k < bone.mNumWeights; ++k) {
        const aiVertexWeight& entry = bone.mWeights[k];
        if (entry.mVertexId >= mesh_.mNumVertices) {
          fail("a weight of vertex " + std::to_string(entry.mVertexId),
               "below the " + std::to_string(mesh_.mNumVertices) + " of the mesh");
        }
        if (!std::isfinite(entry.mWeight) || entry.mWeight < 0) {
          fail("weight " + short_number(entry.mWeight), "0 or more");
        }
        std::vector<Influence>& row = influences_[entry.mVertexId];
        if (entry.mWeight > 0) {
          row.push_back({joint_of_bone[b], entry.mWeight});
        }
        if (row.size() > kMaxInfluences) {
          fail("a vertex of more than " + std::to_string(kMaxInfluences) + " weights",
               "a smaller number");
        }
      }
    }
  }

  const aiMesh& mesh_;
  std::string where_;
  std::string file_;
  std::vector<std::vector<Influence>> influences_;
};

struct Hash {
  const FbxCorners* corners;
  std::size_t operator()(unsigned corner) const { return corners->hash(corner); }
};
struct Same {
  const FbxCorners* corners;
  bool operator()(unsigned a, unsigned b) const { return corners->same(a, b); }
};

void fill_vertices(const aiMesh& mesh, const std::vector<unsigned>& kept,
                   const Eigen::Matrix4d& scene_from_mesh, bool skinned, FbxPrimitive& result) {
  const Eigen::Matrix3d linear = scene_from_mesh.topLeftCorner<3, 3>();
  const Eigen::Vector3d offset = scene_from_mesh.topRightCorner<3, 1>();
  const auto count = static_cast<Index>(kept.size());
  Mesh& target = result.primitive.mesh;
  target.vertices.resize(count, 3);
  const bool normals = !skinned && mesh.mNormals != nullptr;
  target.normals.resize(normals ? count : 0, 3);
  target.uvs.resize(mesh.mTextureCoords[0] != nullptr ? count : 0, 2);
  Eigen::Matrix3d cofactors;
  cofactors.row(0) = linear.row(1).cross(linear.row(2));
  cofactors.row(1) = linear.row(2).cross(linear.row(0));
  cofactors.row(2) = linear.row(0).cross(linear.row(1));
  for (Index v = 0; v < count; ++v) {
    const unsigned corner = kept[static_cast<std::size_t>(v)];
    target.vertices.row(v) = linear * vector_of(mesh.mVertices[corner]) + offset;
    if (normals) {
      target.normals.row(v) = cofactors * vector_of(mesh.mNormals[corner]);
    }
    if (target.uvs.rows() > 0) {
      target.uvs.row(v) << mesh.mTextureCoords[0][corner].x, mesh.mTextureCoords[0][corner].y;
    }
  }
  if (normals && !make_unit_rows(target.normals)) {
    target.normals.resize(0, 3);
  }
  std::set<std::string> seen;
  for (unsigned t = 0; t < mesh.mNumAnimMeshes; ++t) {
    const aiAnimMesh& shape = *mesh.mAnimMeshes[t];
    GltfMorphTarget& morph = result.primitive.targets.emplace_back();
    morph.positions.setZero(count, 3);
    for (Index v = 0; v < count && shape.mVertices != nullptr; ++v) {
      const unsigned corner = kept[static_cast<std::size_t>(v)];
      morph.positions.row(v) =
          linear * (vector_of(shape.mVertices[corner]) - vector_of(mesh.mVertices[corner]));
    }
    std::string name = shape.mName.C_Str();
    result.given_names.push_back(name);
    name = name.empty() ? "morph" : name;
    std::string unique = name;
    for (int number = 2; !seen.insert(unique).second; ++number) {
      unique = name + "_" + std::to_string(number);
    }
    result.target_names.push_back(unique);
  }
}

void fill_influences(const FbxCorners& corners, const std::vector<unsigned>& kept,
                     GltfPrimitive& primitive) {
  std::size_t most = 1;
  for (const unsigned corner : kept) {
    most = std::max(most, corners.influences(corner).size());
  }
  const auto count = static_cast<Index>(kept.size());
  const Index slots = 4 * ((static_cast<Index>(most) + 3) / 4);
  primitive.joints.setZero(count, slots);
  primitive.weights.setZero(count, slots);
  for (Index v = 0; v < count; ++v) {
    Index slot = 0;
    for (const Influence& influence : corners.influences(kept[static_cast<std::size_t>(v)])) {
      primitive.joints(v, slot) = influence.joint;
      primitive.weights(v, slot) = influence.weight;
      ++slot;
    }
  }
}

}  // namespace

FbxPrimitive fbx_primitive(const aiMesh& mesh, const Eigen::Matrix4d& scene_from_mesh,
                           const std::vector<int>& joint_of_bone, const std::string& name) {
  const FbxCorners corners(mesh, joint_of_bone, name);
  std::unordered_set<unsigned, Hash, Same> known(mesh.mNumVertices, Hash{&corners}, Same{&corners});
  std::vector<int> vertex_of(mesh.mNumVertices, -1);
  std::vector<unsigned> kept;
  std::vector<int> faces;
  FbxPrimitive result;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    unsigned first[3] = {0, 0, 0};
    for (unsigned c = 0; face.mNumIndices == 3 && c < 3; ++c) {
      if (face.mIndices[c] >= mesh.mNumVertices) {
        corners.fail("a face with vertex " + std::to_string(face.mIndices[c]),
                     "below the " + std::to_string(mesh.mNumVertices) + " of the mesh");
      }
      first[c] = *known.insert(face.mIndices[c]).first;
    }
    if (first[0] == first[1] || first[1] == first[2] || first[2] == first[0]) {
      ++result.left_out;
      continue;
    }
    for (const unsigned corner : first) {
      if (vertex_of[corner] < 0) {
        vertex_of[corner] = static_cast<int>(kept.size());
        kept.push_back(corner);
      }
      faces.push_back(vertex_of[corner]);
    }
  }
  fill_vertices(mesh, kept, scene_from_mesh, corners.skinned(), result);
  if (corners.skinned()) {
    fill_influences(corners, kept, result.primitive);
  }
  Mesh& target = result.primitive.mesh;
  target.faces = Eigen::Map<const Triangles>(faces.data(), static_cast<Index>(faces.size()) / 3, 3);
  if (scene_from_mesh.topLeftCorner<3, 3>().determinant() < 0) {
    target.faces.col(1).swap(target.faces.col(2));
  }
  if (target.uvs.rows() > 0) {
    target.uv_faces = target.faces;
  }
  return result;
}

}  // namespace atelier

#endif
