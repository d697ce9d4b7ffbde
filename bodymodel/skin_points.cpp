#include "bodymodel/skin_points.h"

#include <algorithm>
#include <map>

#include "core/error.h"

namespace atelier {
namespace {

Vec3d vec(const Eigen::Ref<const Eigen::RowVector3d>& row) {
  return {row[0], row[1], row[2]};
}

/// A joint as rows need it.
struct Turner {
  Vec3d position;
  Vec3d basis[3];  ///< columns: what a component of its rotation vector turns about
};

/// Places that hang on a joint of the chain, weighted, and the sums of their weights.
struct Hanging {
  Vec3d places;
  double weight;
};

/// The joints that move a point, increasing.
std::vector<int> sought_joints_of(const SkinChains& chains, const std::vector<int>& slots,
                                  const FacePoints& points, std::size_t point) {
  std::vector<int> joints;
  for (std::size_t c = 0; c < 3; ++c) {
    if (points.barycentric(static_cast<Index>(point), static_cast<Index>(c)) == 0) {
      continue;
    }
    const auto v = static_cast<std::size_t>(points.vertices[point][c]);
    for (int e = chains.begin[v]; e < chains.begin[v + 1]; ++e) {
      const int joint = chains.joints[static_cast<std::size_t>(e)];
      if (slots[static_cast<std::size_t>(joint)] >= 0) {
        joints.push_back(joint);
      }
    }
  }
  std::sort(joints.begin(), joints.end());
  joints.erase(std::unique(joints.begin(), joints.end()), joints.end());
  return joints;
}

/// The correctives that touch each of the vertices.
void gather_correctives(const BodyModel& model, const SkinChains& chains, SkinPoints& points) {
  points.corrective_begin.reserve(points.vertices.size() + 1);
  points.correctives.reserve(8 * points.vertices.size());
  points.corrective_begin.push_back(0);
  for (const int vertex : points.vertices) {
    const auto v = static_cast<std::size_t>(vertex);
    for (int e = chains.begin[v]; e < chains.begin[v + 1]; ++e) {
      const auto entry = static_cast<std::size_t>(e);
      for (int c = chains.corrective_begin[entry]; c < chains.corrective_begin[entry + 1]; ++c) {
        const auto at = static_cast<std::size_t>(c);
        const int corrective = chains.correctives[at];
        const Points& offsets =
            model.correctives[static_cast<std::size_t>(corrective)].surface.offsets;
        points.correctives.push_back(
            {corrective, chains.joints[entry], vec(offsets.row(chains.corrective_rows[at]))});
      }
    }
    points.corrective_begin.push_back(static_cast<int>(points.correctives.size()));
  }
}

}  // namespace

SkinPoints skin_points(const BodyModel& model, const SkinChains& chains,
                       const std::vector<int>& slots, const FacePoints& points) {
  ATELIER_CHECK(static_cast<Index>(chains.alike.size()) == vertex_count(model),
                "chains of another model");
  ATELIER_CHECK(static_cast<Index>(slots.size()) == joint_count(model), "a slot for each joint");
  ATELIER_CHECK(points.barycentric.rows() == static_cast<Index>(points.vertices.size()),
                "barycentric coordinates for each point");
  const std::vector<int>& parents = model.skeleton.parents;
  std::vector<int> sought(slots.size(), -1);  // itself or the next one above that is
  for (std::size_t j = 0; j < slots.size(); ++j) {
    sought[j] = slots[j] >= 0    ? static_cast<int>(j)
                : parents[j] < 0 ? -1
                                 : sought[static_cast<std::size_t>(parents[j])];
  }
  // Points whose corners are alike are one chain.
  using Alike = std::array<int, 3>;
  constexpr int kNoCorner = -1;
  std::map<Alike, std::vector<int>> of_chain;
  for (std::size_t i = 0; i < points.vertices.size(); ++i) {
    Alike alike{kNoCorner, kNoCorner, kNoCorner};
    for (std::size_t c = 0; c < 3; ++c) {
      const int vertex = points.vertices[i][c];
      ATELIER_CHECK(vertex >= 0 && vertex < vertex_count(model),
                    "vertex " + std::to_string(vertex) + " out of range");
      const int one = chains.alike[static_cast<std::size_t>(vertex)];
      if (points.barycentric(static_cast<Index>(i), static_cast<Index>(c)) != 0 &&
          std::find(alike.begin(), alike.end(), one) == alike.end()) {
        alike[c] = one;
      }
    }
    std::sort(alike.begin(), alike.end());
    of_chain[alike].push_back(static_cast<int>(i));
  }

  SkinPoints ready;
  ready.order.reserve(points.vertices.size());
  ready.bone_begin.reserve(points.vertices.size() + 1);
  ready.corner_begin.reserve(points.vertices.size() + 1);
  ready.bones.reserve(4 * points.vertices.size());
  ready.corners.reserve(3 * points.vertices.size());
  ready.term_begin.reserve(3 * points.vertices.size() + 1);
  ready.terms.reserve(8 * points.vertices.size());
  std::vector<int> used(static_cast<std::size_t>(vertex_count(model)), -1);
  std::vector<int> place(slots.size(), -1);
  ready.bone_begin.push_back(0);
  ready.corner_begin.push_back(0);
  ready.term_begin.push_back(0);
  for (const auto& [alike, members] : of_chain) {
    const std::vector<int> list =
        sought_joints_of(chains, slots, points, static_cast<std::size_t>(members[0]));
    SkinPoints::Chain chain;
    chain.joints = list;
    chain.begin = static_cast<int>(ready.order.size());
    chain.end = chain.begin + static_cast<int>(members.size());
    for (std::size_t l = 0; l < list.size(); ++l) {
      const auto joint = static_cast<std::size_t>(list[l]);
      chain.slots.push_back(slots[joint]);
      ATELIER_CHECK(l == 0 || chain.slots[l] > chain.slots[l - 1], "slots increase with joints");
      int above = parents[joint];
      while (above >= 0 && place[static_cast<std::size_t>(above)] < 0) {
        above = parents[static_cast<std::size_t>(above)];
      }
      chain.above.push_back(above < 0 ? -1 : place[static_cast<std::size_t>(above)]);
      place[joint] = static_cast<int>(l);
    }
    for (const int i : members) {
      ready.order.push_back(i);
      const auto first = static_cast<std::size_t>(ready.bone_begin.back());
      for (std::size_t c = 0; c < 3; ++c) {
        const double barycentric = points.barycentric(i, static_cast<Index>(c));
        if (barycentric == 0) {
          continue;
        }
        const int vertex = points.vertices[static_cast<std::size_t>(i)][c];
        int& at = used[static_cast<std::size_t>(vertex)];
        if (at < 0) {
          at = static_cast<int>(ready.vertices.size());
          ready.vertices.push_back(vertex);
        }
        ready.corners.push_back(at);
        for (Index k = 0; k < model.skin.weights.cols(); ++k) {
          const double share = barycentric * model.skin.weights(vertex, k);
          if (share == 0) {
            continue;
          }
          const int joint = model.skin.joints(vertex, k);
          std::size_t b = first;
          while (b < ready.bones.size() && ready.bones[b].joint != joint) {
            ++b;
          }
          if (b == ready.bones.size()) {
            const int turns = sought[static_cast<std::size_t>(joint)];
            ready.bones.push_back(
                {joint, turns < 0 ? -1 : place[static_cast<std::size_t>(turns)], 0});
          }
          ready.bones[b].weight += share;
          ready.terms.push_back({static_cast<int>(b - first), share});
        }
        ready.term_begin.push_back(static_cast<int>(ready.terms.size()));
      }
      ready.bone_begin.push_back(static_cast<int>(ready.bones.size()));
      ready.corner_begin.push_back(static_cast<int>(ready.corners.size()));
    }
    for (const int joint : list) {
      place[static_cast<std::size_t>(joint)] = -1;
    }
    ready.chains.push_back(std::move(chain));
  }
  gather_correctives(model, chains, ready);
  return ready;
}

namespace {

/// Rest places of the vertices that points hang on, with what correctives add.
std::vector<Vec3d> rest_places(const ShapedBody& body, const PosedBody& posed,
                               const SkinPoints& points) {
  std::vector<Vec3d> rest(points.vertices.size());
  for (std::size_t u = 0; u < rest.size(); ++u) {
    rest[u] = vec(body.vertices.row(points.vertices[u]));
    if (posed.features.size() == 0) {
      continue;
    }
    for (int e = points.corrective_begin[u]; e < points.corrective_begin[u + 1]; ++e) {
      const SkinPoints::Corrective& one = points.correctives[static_cast<std::size_t>(e)];
      rest[u] += posed.features[one.corrective] * one.offset;
    }
  }
  return rest;
}

Vec3d turned(const double* m, Vec3d v) {
  return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[4] * v.x + m[5] * v.y + m[6] * v.z,
          m[8] * v.x + m[9] * v.y + m[10] * v.z};
}
Vec3d turned_back(const double* m, Vec3d v) {
  return {m[0] * v.x + m[4] * v.y + m[8] * v.z, m[1] * v.x + m[5] * v.y + m[9] * v.z,
          m[2] * v.x + m[6] * v.y + m[10] * v.z};
}

/// Works on the points of one chain after the other.
class Visit {
 public:
  Visit(const PosedBody& posed, const SkinPoints& points, std::vector<Vec3d> rest)
      : posed_(posed),
        points_(points),
        rest_(std::move(rest)),
        place_of_joint_(posed.transforms.size(), -1) {
    std::size_t most = 0;
    for (std::size_t i = 0; i + 1 < points.bone_begin.size(); ++i) {
      most =
          std::max(most, static_cast<std::size_t>(points.bone_begin[i + 1] - points.bone_begin[i]));
    }
    places_at_rest_.resize(most);
    directions_at_rest_.resize(most);
  }

  void enter(const SkinPoints::Chain& chain) {
    turners_.clear();
    for (std::size_t l = 0; l < chain.joints.size(); ++l) {
      const auto joint = static_cast<std::size_t>(chain.joints[l]);
      const Eigen::Matrix3d& basis = posed_.bases[joint];
      turners_.push_back({vec(posed_.frames.positions.row(chain.joints[l])),
                          {vec(basis.col(0).transpose()), vec(basis.col(1).transpose()),
                           vec(basis.col(2).transpose())}});
      place_of_joint_[joint] = static_cast<int>(l);
    }
    hanging_.resize(chain.joints.size());
  }
  void leave(const SkinPoints::Chain& chain) {
    for (const int joint : chain.joints) {
      place_of_joint_[static_cast<std::size_t>(joint)] = -1;
    }
  }

  /// Where a point is; `hanging_` then has what hangs on each joint of the chain by itself.
  Vec3d place(std::size_t i) {
    const auto first = static_cast<std::size_t>(points_.bone_begin[i]);
    const auto bones = static_cast<std::size_t>(points_.bone_begin[i + 1]) - first;
    std::fill_n(places_at_rest_.begin(), bones, Vec3d{0, 0, 0});
    for (int c = points_.corner_begin[i]; c < points_.corner_begin[i + 1]; ++c) {
      const auto corner = static_cast<std::size_t>(c);
      const Vec3d rest = rest_[static_cast<std::size_t>(points_.corners[corner])];
      for (int t = points_.term_begin[corner]; t < points_.term_begin[corner + 1]; ++t) {
        const SkinPoints::Term& term = points_.terms[static_cast<std::size_t>(t)];
        places_at_rest_[static_cast<std::size_t>(term.bone)] += term.share * rest;
      }
    }
    std::fill(hanging_.begin(), hanging_.end(), Hanging{{0, 0, 0}, 0});
    Vec3d sum{0, 0, 0};
    for (std::size_t b = 0; b < bones; ++b) {
      const SkinPoints::Bone& bone = points_.bones[first + b];
      const double* m = posed_.transforms[static_cast<std::size_t>(bone.joint)].m;
      const Vec3d moved = turned(m, places_at_rest_[b]) + bone.weight * Vec3d{m[3], m[7], m[11]};
      sum += moved;
      if (bone.place >= 0) {
        Hanging& on = hanging_[static_cast<std::size_t>(bone.place)];
        on.places += moved;
        on.weight += bone.weight;
      }
    }
    return sum;
  }

  /// The derivative of `direction` . place, behind a call of `place` for the same point.
  void row(std::size_t i, const SkinPoints::Chain& chain, Vec3d direction, double* to) {
    *to++ = direction.x;
    *to++ = direction.y;
    *to++ = direction.z;
    for (std::size_t l = chain.joints.size(); l-- > 0;) {  // children come last
      const Hanging& on = hanging_[l];
      if (chain.above[l] >= 0) {
        Hanging& above = hanging_[static_cast<std::size_t>(chain.above[l])];
        above.places += on.places;
        above.weight += on.weight;
      }
      const Turner& turner = turners_[l];
      const Vec3d turn = cross(on.places - on.weight * turner.position, direction);
      for (int k = 0; k < 3; ++k) {
        to[3 * l + static_cast<std::size_t>(k)] = dot(turner.basis[k], turn);
      }
    }
    if (posed_.features.size() > 0) {
      add_correctives(i, direction, to);
    }
  }

 private:
  void add_correctives(std::size_t i, Vec3d direction, double* to) {
    const auto first = static_cast<std::size_t>(points_.bone_begin[i]);
    const auto bones = static_cast<std::size_t>(points_.bone_begin[i + 1]) - first;
    for (std::size_t b = 0; b < bones; ++b) {
      const auto joint = static_cast<std::size_t>(points_.bones[first + b].joint);
      directions_at_rest_[b] = turned_back(posed_.transforms[joint].m, direction);
    }
    for (int c = points_.corner_begin[i]; c < points_.corner_begin[i + 1]; ++c) {
      const auto corner = static_cast<std::size_t>(c);
      const auto vertex = static_cast<std::size_t>(points_.corners[corner]);
      const int begin = points_.corrective_begin[vertex];
      const int end = points_.corrective_begin[vertex + 1];
      if (begin == end) {
        continue;
      }
      Vec3d at_rest{0, 0, 0};
      for (int t = points_.term_begin[corner]; t < points_.term_begin[corner + 1]; ++t) {
        const SkinPoints::Term& term = points_.terms[static_cast<std::size_t>(t)];
        at_rest += term.share * directions_at_rest_[static_cast<std::size_t>(term.bone)];
      }
      for (int e = begin; e < end; ++e) {
        const SkinPoints::Corrective& one = points_.correctives[static_cast<std::size_t>(e)];
        const int place = place_of_joint_[static_cast<std::size_t>(one.joint)];
        if (place < 0) {
          continue;  // a joint that is held
        }
        const double along = dot(one.offset, at_rest);
        const double* by_rotation = posed_.feature_gradient.data() + 3 * one.corrective;
        double* block = to + 3 * place;
        block[0] += along * by_rotation[0];
        block[1] += along * by_rotation[1];
        block[2] += along * by_rotation[2];
      }
    }
  }

  const PosedBody& posed_;
  const SkinPoints& points_;
  const std::vector<Vec3d> rest_;
  std::vector<int> place_of_joint_;  // in the chain
  std::vector<Turner> turners_;
  std::vector<Hanging> hanging_;
  std::vector<Vec3d> places_at_rest_;      // of a point's bones, weighted
  std::vector<Vec3d> directions_at_rest_;  // of a point's bones
};

}  // namespace

void visit_skin_points(const ShapedBody& body, const PosedBody& posed, const SkinPoints& points,
                       const Points& directions,
                       const std::function<void(const ChainRows&)>& visit) {
  const bool derivatives = directions.rows() > 0;
  ATELIER_CHECK(!derivatives || directions.rows() == static_cast<Index>(points.order.size()),
                "one direction for each point");
  Visit work(posed, points, rest_places(body, posed, points));
  Points places;
  RowMatrix rows;
  for (const SkinPoints::Chain& chain : points.chains) {
    const Index count = chain.end - chain.begin;
    places.resize(count, 3);
    rows.resize(derivatives ? count : 0, 3 + 3 * static_cast<Index>(chain.joints.size()));
    work.enter(chain);
    for (Index m = 0; m < count; ++m) {
      const auto i = static_cast<std::size_t>(chain.begin + m);
      const Vec3d at = work.place(i);
      places.row(m) << at.x, at.y, at.z;
      if (derivatives) {
        work.row(i, chain, vec(directions.row(points.order[i])), rows.row(m).data());
      }
    }
    work.leave(chain);
    visit({chain,
           std::span<const int>(points.order)
               .subspan(static_cast<std::size_t>(chain.begin), static_cast<std::size_t>(count)),
           places, rows});
  }
}

}  // namespace atelier
