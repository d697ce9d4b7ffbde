#include "simulation/prepared_cloth.h"

#include <limits>

#include "core/error.h"

namespace atelier {

template <class T>
PreparedCloth<T> prepare_cloth(const Cloth& cloth) {
  PreparedCloth<T> out;
  const Schedule& schedule = cloth.schedule;
  const int n = static_cast<int>(cloth.mass.size());
  out.count = n;
  out.phases = schedule.phases;
  out.patches = schedule.patches;
  out.order = schedule.order;
  out.max_patch_particles = schedule.max_patch_vertices;
  ATELIER_CHECK(schedule.max_patch_vertices <= std::numeric_limits<std::uint16_t>::max(),
                "a patch holds more particles than its indices can name");
  ATELIER_CHECK(!schedule.phases.empty(), "the cloth has no schedule: call rebuild_schedule");
  const int last_first = schedule.phases[0].patch_end - 1;
  ATELIER_CHECK(schedule.patches[last_first].vertex_end == n, "the schedule is of another cloth");
  out.external.assign(schedule.vertices.begin(), schedule.vertices.begin() + n);
  out.internal.assign(static_cast<std::size_t>(n), 0);
  for (int i = 0; i < n; ++i) {
    out.internal[out.external[i]] = i;
  }
  out.patch_particles.reserve(schedule.vertices.size());
  for (int v : schedule.vertices) {
    out.patch_particles.push_back(out.internal[v]);
  }
  out.inverse_mass.resize(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    const int v = out.external[i];
    out.inverse_mass[i] = cloth.fixed[v] ? T(0) : static_cast<T>(1 / cloth.mass[v]);
  }
  const int springs = static_cast<int>(cloth.springs.size());
  const int hinges = springs + static_cast<int>(cloth.hinges.size());
  std::vector<std::uint16_t> place(static_cast<std::size_t>(n), 0);
  out.records.resize(schedule.order.size());
  for (const Schedule::Patch& patch : schedule.patches) {
    for (int i = patch.vertex_begin; i < patch.vertex_end; ++i) {
      place[schedule.vertices[i]] = static_cast<std::uint16_t>(i - patch.vertex_begin);
    }
    for (int k = patch.colour_begin; k < patch.colour_end; ++k) {
      const Schedule::Colour& colour = schedule.colours[k];
      PreparedColour prepared{{colour.begin[0], colour.begin[1], colour.begin[2], colour.begin[3]},
                              static_cast<int>(out.strains.size())};
      for (int i = colour.begin[0]; i < colour.begin[3]; ++i) {
        const int c = schedule.order[i];
        ConstraintRecord<T>& record = out.records[i];
        record = {{0, 0, 0, 0}, T(0), T(0)};
        if (c < springs) {
          const ClothSpring& s = cloth.springs[c];
          record = {{place[s.a], place[s.b], 0, 0},
                    static_cast<T>(s.rest),
                    static_cast<T>(1 / s.stiffness)};
        } else if (c < hinges) {
          const ClothHinge& h = cloth.hinges[c - springs];
          record = {{place[h.edge0], place[h.edge1], place[h.left], place[h.right]},
                    static_cast<T>(h.rest),
                    static_cast<T>(1 / h.stiffness)};
        } else {
          const ClothStrain& s = cloth.strains[c - hinges];
          record.particle[0] = place[s.v0];
          record.particle[1] = place[s.v1];
          record.particle[2] = place[s.v2];
          const auto compliance = [](double stiffness) {
            return static_cast<T>(stiffness > 0 ? 1 / stiffness : 1e30);
          };
          out.strains.push_back(
              {static_cast<T>(s.inverse_rest[0]), static_cast<T>(s.inverse_rest[1]),
               static_cast<T>(s.inverse_rest[2]), static_cast<T>(s.inverse_rest[3]),
               compliance(s.warp), compliance(s.weft), compliance(s.shear)});
        }
      }
      out.colours.push_back(prepared);
    }
  }
  if (!cloth.tethers.empty()) {
    out.tether_anchor.assign(static_cast<std::size_t>(n), -1);
    out.tether_length.assign(static_cast<std::size_t>(n), T(0));
    for (const ClothTether& t : cloth.tethers) {
      out.tether_anchor[out.internal[t.vertex]] = out.internal[t.anchor];
      out.tether_length[out.internal[t.vertex]] = static_cast<T>(t.length);
    }
  }
  return out;
}

template PreparedCloth<float> prepare_cloth(const Cloth&);
template PreparedCloth<double> prepare_cloth(const Cloth&);

}  // namespace atelier
