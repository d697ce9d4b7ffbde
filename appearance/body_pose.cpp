#include "appearance/body_pose.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <string>
#include <utility>

#include "core/error.h"

namespace atelier {
namespace {

/// The rotations of all parts from rest, [J], world; nothing of a part whose vertices lie on a
/// line.
struct Turn {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  bool known = false;
};

std::vector<Turn> turns_of(const BodyParts& parts, const Eigen::Ref<const FloatRows>& position) {
  const std::size_t count = parts.parents.size();
  std::vector<Eigen::Vector3d> rest_sum(count, Eigen::Vector3d::Zero());
  std::vector<Eigen::Vector3d> sum(count, Eigen::Vector3d::Zero());
  std::vector<double> size(count, 0);
  const auto part_of = [&](Index v) {
    return static_cast<std::size_t>(parts.part[static_cast<std::size_t>(v)]);
  };
  for (Index v = 0; v < position.rows(); ++v) {
    rest_sum[part_of(v)] += parts.rest.row(v).transpose().cast<double>();
    sum[part_of(v)] += position.row(v).transpose().cast<double>();
    size[part_of(v)] += 1;
  }
  std::vector<Eigen::Matrix3d> spread(count, Eigen::Matrix3d::Zero());
  for (Index v = 0; v < position.rows(); ++v) {
    const std::size_t j = part_of(v);
    const Eigen::Vector3d from =
        parts.rest.row(v).transpose().cast<double>() - rest_sum[j] / size[j];
    const Eigen::Vector3d to = position.row(v).transpose().cast<double>() - sum[j] / size[j];
    spread[j] += to * from.transpose();
  }
  std::vector<Turn> turns(count);
  for (std::size_t j = 0; j < count; ++j) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(spread[j],
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    constexpr double kLeast = 1e-4;  // of the largest spread: less is a line
    turns[j].known = svd.singularValues()[1] > kLeast * svd.singularValues()[0];
    if (turns[j].known) {
      Eigen::Vector3d signs = Eigen::Vector3d::Ones();
      signs[2] = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
      turns[j].rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
    }
  }
  return turns;
}

}  // namespace

void check_body_parts(const BodyParts& parts, const std::string& file) {
  const auto count = static_cast<int>(parts.parents.size());
  const auto refuse = [&](const std::string& where, int found, int below) {
    throw DataError(file, where, std::to_string(found), "0 to " + std::to_string(below));
  };
  if (count == 0 || parts.rest.rows() != static_cast<Index>(parts.part.size()) ||
      !parts.rest.allFinite()) {
    throw DataError(file, "body parts", std::to_string(parts.part.size()) + " vertices",
                    std::to_string(parts.rest.rows()) + " finite places, and one part or more");
  }
  for (int j = 0; j < count; ++j) {
    if (const int parent = parts.parents[static_cast<std::size_t>(j)]; parent < 0 || parent > j) {
      refuse("parent of part " + std::to_string(j), parent, j);
    }
  }
  const bool ranged = !parts.low.empty() || !parts.high.empty();
  const std::size_t numbers = 3 * parts.parents.size();
  if (ranged && (parts.low.size() != numbers || parts.high.size() != numbers)) {
    throw DataError(file, "range of poses", std::to_string(parts.low.size()) + " numbers",
                    std::to_string(numbers) + ", three for each part");
  }
  for (std::size_t i = 0; i < parts.low.size(); ++i) {
    if (!(parts.low[i] <= parts.high[i])) {
      throw DataError(file, "range of poses", std::to_string(parts.low[i]),
                      "at most " + std::to_string(parts.high[i]));
    }
  }
  for (const int part : parts.part) {
    if (part < 0 || part >= count) {
      refuse("part of a vertex", part, count - 1);
    }
  }
}

BodyParts with_face(BodyParts parts, int head, int points) {
  ATELIER_CHECK(head >= 0 && head < static_cast<int>(parts.parents.size()) && points >= 0 &&
                    parts.low.empty(),
                "a face hangs on a part, before anything is learnt");
  parts.parents.insert(parts.parents.end(), static_cast<std::size_t>(points), head);
  return parts;
}

int face_points(const BodyParts& parts) {
  const int last =
      parts.part.empty() ? -1 : *std::max_element(parts.part.begin(), parts.part.end());
  return static_cast<int>(parts.parents.size()) - 1 - last;
}

BodyParts body_parts(const Points& rest, const std::vector<int>& joints,
                     const std::vector<int>& parents) {
  constexpr int kFewest = 12;  // vertices, of which a rotation is told
  std::vector<int> size(parents.size(), 0);
  for (const int j : joints) {
    ++size.at(static_cast<std::size_t>(j));
  }
  // Children first: a part that is too small gives its vertices to the joint that it hangs on.
  std::vector<int> owner(parents.size());
  for (std::size_t j = 0; j < parents.size(); ++j) {
    owner[j] = static_cast<int>(j);
  }
  for (std::size_t j = parents.size(); j-- > 0;) {
    if (size[j] < kFewest && parents[j] >= 0) {
      owner[j] = parents[j];
      size[static_cast<std::size_t>(parents[j])] += size[j];
    }
  }
  const auto owner_of = [&](int j) {
    while (owner[static_cast<std::size_t>(j)] != j) {
      j = owner[static_cast<std::size_t>(j)];
    }
    return j;
  };
  BodyParts parts;
  parts.rest = rest.cast<float>();
  std::vector<int> number(parents.size(), -1);
  for (std::size_t j = 0; j < parents.size(); ++j) {
    if (owner[j] == static_cast<int>(j)) {
      number[j] = static_cast<int>(parts.parents.size());
      parts.parents.push_back(
          parents[j] < 0 ? number[j] : number[static_cast<std::size_t>(owner_of(parents[j]))]);
    }
  }
  for (const int j : joints) {
    parts.part.push_back(number[static_cast<std::size_t>(owner_of(j))]);
  }
  check_body_parts(parts);
  return parts;
}

std::vector<float> pose_code(const BodyParts& parts, const Eigen::Ref<const FloatRows>& position,
                             const std::vector<float>& face) {
  ATELIER_CHECK(position.rows() == parts.rest.rows(), "the body has another number of vertices");
  ATELIER_CHECK(face.empty() || face.size() == 3 * static_cast<std::size_t>(face_points(parts)),
                "a face has as many points as what was learnt from");
  const std::vector<Turn> turns = turns_of(parts, position);
  std::vector<float> code;
  code.reserve(3 * turns.size());
  for (std::size_t j = 0; j < turns.size(); ++j) {
    const Turn& parent = turns[static_cast<std::size_t>(parts.parents[j])];
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
    if (turns[j].known && parent.known) {
      const Eigen::AngleAxisd bend(
          Eigen::Matrix3d(parent.rotation.transpose() * turns[j].rotation));
      turn = bend.angle() * bend.axis();
    }
    for (const double number : turn) {
      code.push_back(static_cast<float>(number));
    }
  }
  std::copy(face.begin(), face.end(), code.end() - static_cast<std::ptrdiff_t>(face.size()));
  for (std::size_t i = 0; i < parts.low.size(); ++i) {
    code[i] = std::clamp(code[i], parts.low[i], parts.high[i]);
  }
  return code;
}

BodyParts with_range(BodyParts parts, const std::vector<SurfaceFrame>& frames) {
  parts.low.clear();
  parts.high.clear();
  std::vector<float> low;
  std::vector<float> high;
  for (const SurfaceFrame& frame : frames) {
    const std::vector<float> code = pose_code(parts, frame.position, frame.face);
    if (low.empty()) {
      low = high = code;
    }
    for (std::size_t i = 0; i < code.size(); ++i) {
      low[i] = std::min(low[i], code[i]);
      high[i] = std::max(high[i], code[i]);
    }
  }
  parts.low = std::move(low);
  parts.high = std::move(high);
  return parts;
}

Eigen::MatrixXf pose_masks(const BodyParts& parts, const Triangles& faces, int rings) {
  Eigen::MatrixXf masks = Eigen::MatrixXf::Zero(static_cast<Index>(parts.part.size()),
                                                static_cast<Index>(parts.parents.size()));
  for (Index v = 0; v < masks.rows(); ++v) {
    const int own = parts.part[static_cast<std::size_t>(v)];
    masks(v, own) = 1;
    for (std::size_t j = 0; j < parts.parents.size(); ++j) {
      if (parts.parents[j] == own) {
        masks(v, static_cast<Index>(j)) = 1;
      }
    }
  }
  for (int ring = 0; ring < rings; ++ring) {
    Eigen::MatrixXf sum = masks;
    Eigen::VectorXf count = Eigen::VectorXf::Ones(masks.rows());
    for (Index f = 0; f < faces.rows(); ++f) {
      for (Index k = 0; k < 3; ++k) {
        sum.row(faces(f, k)) += masks.row(faces(f, (k + 1) % 3)) + masks.row(faces(f, (k + 2) % 3));
        count[faces(f, k)] += 2;
      }
    }
    masks = count.cwiseInverse().asDiagonal() * sum;
  }
  return masks;
}

}  // namespace atelier
