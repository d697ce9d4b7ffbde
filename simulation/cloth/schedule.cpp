#include "simulation/cloth/schedule.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <tuple>

#include "core/error.h"
#include "simulation/cloth/colouring.h"

namespace atelier {
namespace {

/// Particles of a range of constraints, and the constraints of each particle.
struct Incidence {
  std::vector<int> begin;
  std::vector<int> constraint;
};

Incidence incidence_of(int vertex_count, const std::vector<ConstraintParticles>& constraints,
                       const std::vector<int>& subset) {
  Incidence out;
  out.begin.assign(static_cast<std::size_t>(vertex_count) + 1, 0);
  for (int c : subset) {
    for (int v : constraints[c].particle) {
      if (v >= 0) {
        ++out.begin[v + 1];
      }
    }
  }
  std::partial_sum(out.begin.begin(), out.begin.end(), out.begin.begin());
  out.constraint.resize(static_cast<std::size_t>(out.begin.back()));
  std::vector<int> cursor(out.begin.begin(), out.begin.end() - 1);
  for (int c : subset) {
    for (int v : constraints[c].particle) {
      if (v >= 0) {
        out.constraint[cursor[v]++] = c;
      }
    }
  }
  return out;
}

/// Halves the range of particles along its longest axis until `parts` parts are made; parts of a
/// range differ in size by at most one particle per level.
void bisect(const Points& positions, std::vector<int>& ids, int begin, int end, int first_part,
            int parts, std::vector<int>& part_of) {
  if (parts == 1) {
    for (int i = begin; i < end; ++i) {
      part_of[ids[i]] = first_part;
    }
    return;
  }
  Eigen::RowVector3d low = positions.row(ids[begin]);
  Eigen::RowVector3d high = low;
  for (int i = begin; i < end; ++i) {
    low = low.cwiseMin(positions.row(ids[i]));
    high = high.cwiseMax(positions.row(ids[i]));
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const int left_parts = parts / 2;
  const int middle =
      begin + static_cast<int>(static_cast<std::int64_t>(end - begin) * left_parts / parts);
  std::nth_element(ids.begin() + begin, ids.begin() + middle, ids.begin() + end, [&](int a, int b) {
    const double pa = positions(a, axis);
    const double pb = positions(b, axis);
    return pa != pb ? pa < pb : a < b;
  });
  bisect(positions, ids, begin, middle, first_part, left_parts, part_of);
  bisect(positions, ids, middle, end, first_part + left_parts, parts - left_parts, part_of);
}

/// Visits particles breadth first along constraints, from `seed`, appending to `visited`.
void breadth_first(int seed, const std::vector<ConstraintParticles>& constraints,
                   const Incidence& incidence, std::vector<char>& seen, std::vector<int>& visited,
                   std::vector<int>* level) {
  std::size_t head = visited.size();
  visited.push_back(seed);
  seen[seed] = 1;
  if (level != nullptr) {
    (*level)[seed] = 0;
  }
  for (; head < visited.size(); ++head) {
    const int v = visited[head];
    for (int k = incidence.begin[v]; k < incidence.begin[v + 1]; ++k) {
      for (int u : constraints[incidence.constraint[k]].particle) {
        if (u >= 0 && !seen[u]) {
          seen[u] = 1;
          if (level != nullptr) {
            (*level)[u] = (*level)[v] + 1;
          }
          visited.push_back(u);
        }
      }
    }
  }
}

/// Particles of the component of `seed`, breadth first from one of its far ends.
std::vector<int> ordered_component(int seed, const std::vector<ConstraintParticles>& constraints,
                                   const Incidence& incidence, std::vector<char>& seen,
                                   std::vector<int>& level) {
  std::vector<int> first;
  breadth_first(seed, constraints, incidence, seen, first, nullptr);
  for (int v : first) {
    seen[v] = 0;
  }
  std::vector<int> ordered;
  breadth_first(first.back(), constraints, incidence, seen, ordered, &level);
  return ordered;
}

/// Phase 0: strips of a breadth-first order where each is several rings wide (then only neighbours
/// touch, and two phases are enough), else compact blocks by coordinate bisection.
std::vector<int> partition(const Points& positions,
                           const std::vector<ConstraintParticles>& constraints,
                           const std::vector<int>& all, int parts) {
  const int vertex_count = static_cast<int>(positions.rows());
  std::vector<int> part_of(static_cast<std::size_t>(vertex_count), 0);
  if (parts <= 1) {
    return part_of;
  }
  const Incidence incidence = incidence_of(vertex_count, constraints, all);
  std::vector<char> seen(static_cast<std::size_t>(vertex_count), 0);
  std::vector<int> level(static_cast<std::size_t>(vertex_count), 0);
  std::vector<int> ordered;
  int levels = 0;
  for (int v = 0; v < vertex_count; ++v) {
    if (!seen[v]) {
      const std::vector<int> component = ordered_component(v, constraints, incidence, seen, level);
      levels += level[component.back()] + 1;
      ordered.insert(ordered.end(), component.begin(), component.end());
    }
  }
  // A hinge spans two rings, so a strip needs four of its own for its two borders to stay apart;
  // breadth-first levels along hinges count two rings each.
  constexpr int kLevelsPerStrip = 3;
  if (levels >= kLevelsPerStrip * parts) {
    for (int i = 0; i < vertex_count; ++i) {
      part_of[ordered[i]] = static_cast<int>(static_cast<std::int64_t>(i) * parts / vertex_count);
    }
    return part_of;
  }
  std::vector<int> ids(static_cast<std::size_t>(vertex_count));
  std::iota(ids.begin(), ids.end(), 0);
  bisect(positions, ids, 0, vertex_count, 0, parts, part_of);
  return part_of;
}

/// For each constraint of kind 0 the one of kind 1 on its first two particles, -1: none. Pairs are
/// unique; what has been paired is marked in `follows`.
std::vector<int> pair_up(const std::vector<ConstraintParticles>& constraints,
                         std::vector<char>& follows) {
  struct Edge {
    int low, high, constraint;
  };
  std::vector<Edge> edges;
  for (std::size_t c = 0; c < constraints.size(); ++c) {
    const std::array<int, 4>& p = constraints[c].particle;
    if (constraints[c].kind == 1 && p[0] >= 0 && p[1] >= 0 && p[2] < 0) {
      edges.push_back({std::min(p[0], p[1]), std::max(p[0], p[1]), static_cast<int>(c)});
    }
  }
  const auto before = [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.constraint) < std::tie(b.low, b.high, b.constraint);
  };
  std::sort(edges.begin(), edges.end(), before);
  follows.assign(constraints.size(), 0);
  std::vector<int> follower(constraints.size(), -1);
  for (std::size_t c = 0; c < constraints.size(); ++c) {
    const std::array<int, 4>& p = constraints[c].particle;
    if (constraints[c].kind != 0 || p[0] < 0 || p[1] < 0) {
      continue;
    }
    const Edge wanted{std::min(p[0], p[1]), std::max(p[0], p[1]), -1};
    auto at = std::lower_bound(edges.begin(), edges.end(), wanted, before);
    while (at != edges.end() && at->low == wanted.low && at->high == wanted.high &&
           follows[at->constraint] != 0) {
      ++at;
    }
    if (at != edges.end() && at->low == wanted.low && at->high == wanted.high) {
      follower[c] = at->constraint;
      follows[at->constraint] = 1;
    }
  }
  return follower;
}

/// Appends the colours of one patch to the schedule. `place` is scratch, one entry a particle.
void colour_patch(const std::vector<ConstraintParticles>& constraints,
                  const std::vector<int>& follower, const std::vector<int>& patch,
                  const std::vector<int>& patch_particles, std::vector<int>& place,
                  Schedule& schedule) {
  for (std::size_t i = 0; i < patch_particles.size(); ++i) {
    place[patch_particles[i]] = static_cast<int>(i);
  }
  std::vector<std::array<int, 4>> groups;
  for (int c : patch) {
    std::array<int, 4> group = constraints[c].particle;
    for (int& v : group) {
      v = v >= 0 ? place[v] : -1;
    }
    groups.push_back(group);
  }
  const std::vector<int> colour = colour_groups(groups, static_cast<int>(patch_particles.size()));
  const int colour_count = groups.empty() ? 0 : 1 + *std::max_element(colour.begin(), colour.end());
  std::vector<std::vector<int>> classes(static_cast<std::size_t>(colour_count));
  for (std::size_t g = 0; g < groups.size(); ++g) {
    classes[colour[g]].push_back(static_cast<int>(g));
  }
  Schedule::Patch out{static_cast<int>(schedule.vertices.size()), 0,
                      static_cast<int>(schedule.colours.size()), 0};
  for (std::vector<int>& members : classes) {
    // Neighbours in memory beside each other; those with a follower first.
    const auto rank = [&](int g) {
      return std::make_tuple(constraints[patch[g]].kind, follower[patch[g]] < 0, groups[g]);
    };
    std::sort(members.begin(), members.end(), [&](int a, int b) { return rank(a) < rank(b); });
    Schedule::Colour range{};
    std::size_t i = 0;
    for (int kind = 0; kind < 3; ++kind) {
      range.begin[kind] = static_cast<int>(schedule.order.size());
      if (kind == 1) {
        for (int k = 0; k < range.paired; ++k) {
          schedule.order.push_back(follower[patch[members[k]]]);
        }
      }
      for (; i < members.size() && constraints[patch[members[i]]].kind == kind; ++i) {
        const int c = patch[members[i]];
        range.paired += follower[c] >= 0 ? 1 : 0;
        schedule.order.push_back(c);
      }
    }
    range.begin[3] = static_cast<int>(schedule.order.size());
    schedule.colours.push_back(range);
  }
  out.colour_end = static_cast<int>(schedule.colours.size());
  schedule.max_colours = std::max(schedule.max_colours, colour_count);
  schedule.patches.push_back(out);
}

int default_patches(int vertex_count) {
  constexpr int kVertices = 640;
  constexpr int kWave = 132;
  constexpr int kLargestCluster = 16;  // their sizes are powers of two
  const int patches = (vertex_count + kVertices - 1) / kVertices;
  if (patches <= kLargestCluster) {
    return static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::max(1, patches))));
  }
  if (patches <= kWave) {
    return patches;
  }
  constexpr int kLargest = 1150;
  const int waves = (vertex_count + kWave * kLargest - 1) / (kWave * kLargest);
  return waves * kWave;
}

int part_count_of(int vertex_count, const ScheduleOptions& options) {
  int parts = options.patches > 0 ? options.patches : default_patches(vertex_count);
  parts =
      std::max(parts, (vertex_count + options.max_patch_vertices - 1) / options.max_patch_vertices);
  return std::min(parts, vertex_count);
}

/// Particles cut into parts.
struct Parts {
  std::vector<int> part_of;  ///< [V] which part each particle is in
  int count = 0;
};

/// Constraints all of whose particles are in one part, by part, and those that lie across parts.
struct SharedOut {
  std::vector<std::vector<int>> inside;
  std::vector<int> across;
};

SharedOut share_out(const std::vector<ConstraintParticles>& constraints,
                    const std::vector<int>& remaining, const Parts& parts) {
  SharedOut shared;
  shared.inside.resize(static_cast<std::size_t>(parts.count));
  for (int c : remaining) {
    int part = -1;
    bool inside = true;
    for (int v : constraints[c].particle) {
      if (v >= 0) {
        inside = inside && (part < 0 || part == parts.part_of[v]);
        part = parts.part_of[v];
      }
    }
    (inside && part >= 0 ? shared.inside[part] : shared.across).push_back(c);
  }
  return shared;
}

/// Every particle, ascending, by its part.
std::vector<std::vector<int>> all_particles(const Parts& parts) {
  std::vector<std::vector<int>> particles(static_cast<std::size_t>(parts.count));
  for (std::size_t v = 0; v < parts.part_of.size(); ++v) {
    particles[parts.part_of[v]].push_back(static_cast<int>(v));
  }
  return particles;
}

/// The particles of each part's constraints, ascending.
std::vector<std::vector<int>> constrained_particles(
    const std::vector<ConstraintParticles>& constraints,
    const std::vector<std::vector<int>>& inside, int vertex_count) {
  std::vector<std::vector<int>> particles(inside.size());
  std::vector<char> listed(static_cast<std::size_t>(vertex_count), 0);
  for (std::size_t part = 0; part < inside.size(); ++part) {
    for (int c : inside[part]) {
      for (int v : constraints[c].particle) {
        if (v >= 0 && !listed[v]) {
          listed[v] = 1;
          particles[part].push_back(v);
        }
      }
    }
    std::sort(particles[part].begin(), particles[part].end());
  }
  return particles;
}

/// The parts of a phase after the first: components of what remains, small ones whole and packed
/// together up to about `target` particles, large ones cut into runs of their breadth-first order.
/// Constraints that cross a cut wait for the phase after.
Parts parts_of_remaining(int vertex_count, const std::vector<ConstraintParticles>& constraints,
                         const Incidence& incidence, int target, int max_patch_vertices) {
  Parts parts;
  parts.part_of.assign(static_cast<std::size_t>(vertex_count), 0);
  std::vector<char> seen(static_cast<std::size_t>(vertex_count), 0);
  std::vector<int> level(static_cast<std::size_t>(vertex_count), 0);
  int filled = max_patch_vertices + 1;
  for (int v = 0; v < vertex_count; ++v) {
    if (seen[v] || incidence.begin[v + 1] == incidence.begin[v]) {
      continue;
    }
    const std::vector<int> component = ordered_component(v, constraints, incidence, seen, level);
    const int size = static_cast<int>(component.size());
    if (size <= std::min(2 * target, max_patch_vertices)) {
      if (filled + size > target + target / 4) {
        ++parts.count;
        filled = 0;
      }
      filled += size;
      for (int u : component) {
        parts.part_of[u] = parts.count - 1;
      }
    } else {
      const int pieces = (size + target - 1) / target;
      for (int i = 0; i < size; ++i) {
        parts.part_of[component[i]] =
            parts.count + static_cast<int>(static_cast<std::int64_t>(i) * pieces / size);
      }
      parts.count += pieces;
      filled = max_patch_vertices + 1;
    }
  }
  return parts;
}

int touched_particles(const Incidence& incidence) {
  int touched = 0;
  for (std::size_t v = 0; v + 1 < incidence.begin.size(); ++v) {
    touched += incidence.begin[v + 1] > incidence.begin[v] ? 1 : 0;
  }
  return touched;
}

void check_particles(const std::vector<ConstraintParticles>& constraints, int vertex_count) {
  for (const ConstraintParticles& c : constraints) {
    ATELIER_CHECK(c.kind >= 0 && c.kind < 3, "constraint kind " + std::to_string(c.kind));
    for (int v : c.particle) {
      ATELIER_CHECK(v < vertex_count, "particle " + std::to_string(v) + " of a constraint");
    }
  }
}

}  // namespace

Schedule make_schedule(const Points& positions, const std::vector<ConstraintParticles>& constraints,
                       const ScheduleOptions& options) {
  const int vertex_count = static_cast<int>(positions.rows());
  check_particles(constraints, vertex_count);
  Schedule schedule;
  if (vertex_count == 0) {
    return schedule;
  }
  std::vector<char> follows;
  const std::vector<int> follower = pair_up(constraints, follows);
  std::vector<int> remaining;
  for (std::size_t c = 0; c < constraints.size(); ++c) {
    if (follows[c] == 0) {
      remaining.push_back(static_cast<int>(c));
    }
  }
  const int first_count = part_count_of(vertex_count, options);
  Parts parts{partition(positions, constraints, remaining, first_count), first_count};
  std::vector<int> place(static_cast<std::size_t>(vertex_count), 0);
  int target_floor = 48;  // of the later phases' patches; grows so that the cuts get rarer
  do {
    const SharedOut shared = share_out(constraints, remaining, parts);
    // Phase 0 lists every particle once, so it is also where particles are integrated.
    const std::vector<std::vector<int>> particles =
        schedule.phases.empty() ? all_particles(parts)
                                : constrained_particles(constraints, shared.inside, vertex_count);
    const int patch_begin = static_cast<int>(schedule.patches.size());
    for (std::size_t part = 0; part < particles.size(); ++part) {
      if (particles[part].empty()) {
        continue;
      }
      colour_patch(constraints, follower, shared.inside[part], particles[part], place, schedule);
      Schedule::Patch& patch = schedule.patches.back();
      patch.vertex_begin = static_cast<int>(schedule.vertices.size());
      schedule.vertices.insert(schedule.vertices.end(), particles[part].begin(),
                               particles[part].end());
      patch.vertex_end = static_cast<int>(schedule.vertices.size());
      schedule.max_patch_vertices =
          std::max(schedule.max_patch_vertices, patch.vertex_end - patch.vertex_begin);
    }
    schedule.phases.push_back({patch_begin, static_cast<int>(schedule.patches.size())});
    remaining = shared.across;
    if (!remaining.empty()) {
      const Incidence incidence = incidence_of(vertex_count, constraints, remaining);
      const int target = std::clamp((touched_particles(incidence) + first_count - 1) / first_count,
                                    target_floor, options.max_patch_vertices);
      target_floor = std::min(2 * target_floor, options.max_patch_vertices);
      parts = parts_of_remaining(vertex_count, constraints, incidence, target,
                                 options.max_patch_vertices);
    }
  } while (!remaining.empty());
  return schedule;
}

}  // namespace atelier
