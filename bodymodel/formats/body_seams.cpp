#include "bodymodel/formats/body_seams.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/topology.h"

namespace atelier {
namespace {

// -1, 0 or 1 as row a of the matrix stands before, with or after row b.
template <class Rows>
int compared(const Rows& rows, int a, int b) {
  for (Index c = 0; c < rows.cols(); ++c) {
    if (rows(a, c) != rows(b, c)) {
      return rows(a, c) < rows(b, c) ? -1 : 1;
    }
  }
  return 0;
}

int compared(const BodyModel& model, int a, int b) {
  int order = compared(model.mesh.vertices, a, b);
  order = order != 0 ? order : compared(model.skin.joints, a, b);
  order = order != 0 ? order : compared(model.skin.weights, a, b);
  for (std::size_t s = 0; order == 0 && s < model.shape.size(); ++s) {
    order = compared(model.shape[s].surface.offsets, a, b);
  }
  return order;
}

// [V] the same number for vertices that agree in everything.
std::vector<int> kinds_of(const BodyModel& model) {
  std::vector<int> order(static_cast<std::size_t>(vertex_count(model)));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const int sign = compared(model, a, b);
    return sign < 0 || (sign == 0 && a < b);
  });
  std::vector<int> kinds(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool as_before = i > 0 && compared(model, order[i - 1], order[i]) == 0;
    kinds[static_cast<std::size_t>(order[i])] =
        as_before ? kinds[static_cast<std::size_t>(order[i - 1])] : order[i];
  }
  return kinds;
}

int root_of(std::vector<int>& above, int v) {
  while (above[static_cast<std::size_t>(v)] != v) {
    int& next = above[static_cast<std::size_t>(v)];
    next = above[static_cast<std::size_t>(next)];
    v = next;
  }
  return v;
}

void join(std::vector<int>& above, int a, int b) {
  a = root_of(above, a);
  b = root_of(above, b);
  above[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
}

// An edge of one face alone, in that face's direction.
struct OpenEdge {
  std::array<int, 2> kinds;  // smaller first
  std::array<int, 2> ends;   // vertices of those kinds
  bool forward;              // whether the face runs from the smaller to the larger
};

std::vector<OpenEdge> open_edges(const Triangles& faces, const std::vector<int>& kinds) {
  const Topology topology = topology_of(faces, static_cast<Index>(kinds.size()));
  std::vector<OpenEdge> open;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto corners = corners_of_edge(topology, e);
    if (corners.size() != 1) {
      continue;
    }
    const int a = faces(corners[0] / 3, corners[0] % 3);
    const int b = faces(corners[0] / 3, (corners[0] + 1) % 3);
    const int kind_a = kinds[static_cast<std::size_t>(a)];
    const int kind_b = kinds[static_cast<std::size_t>(b)];
    if (kind_a < kind_b) {
      open.push_back({{kind_a, kind_b}, {a, b}, true});
    } else if (kind_b < kind_a) {
      open.push_back({{kind_b, kind_a}, {b, a}, false});
    }
  }
  std::stable_sort(open.begin(), open.end(),
                   [](const OpenEdge& a, const OpenEdge& b) { return a.kinds < b.kinds; });
  return open;
}

template <class Rows>
void keep_rows(Rows& rows, const std::vector<int>& kept) {
  Rows result(static_cast<Index>(kept.size()), rows.cols());
  for (std::size_t i = 0; i < kept.size(); ++i) {
    result.row(static_cast<Index>(i)) = rows.row(kept[i]);
  }
  rows = std::move(result);
}

}  // namespace

BodyModel without_seams(BodyModel model) {
  ATELIER_CHECK(model.correctives.empty() && model.regressor.empty() && model.groups.empty(),
                "parts of the body name vertices that would be joined");
  const std::vector<OpenEdge> open = open_edges(model.mesh.faces, kinds_of(model));
  std::vector<int> above(static_cast<std::size_t>(vertex_count(model)));
  std::iota(above.begin(), above.end(), 0);
  for (std::size_t i = 0; i < open.size();) {
    std::size_t end = i + 1;
    while (end < open.size() && open[end].kinds == open[i].kinds) {
      ++end;
    }
    if (end - i == 2 && open[i].forward != open[i + 1].forward) {
      join(above, open[i].ends[0], open[i + 1].ends[0]);
      join(above, open[i].ends[1], open[i + 1].ends[1]);
    }
    i = end;
  }
  std::vector<int> kept;
  std::vector<int> number(above.size());
  for (int v = 0; v < static_cast<int>(above.size()); ++v) {
    const int root = root_of(above, v);  // never larger than v
    if (root == v) {
      number[static_cast<std::size_t>(v)] = static_cast<int>(kept.size());
      kept.push_back(v);
    } else {
      number[static_cast<std::size_t>(v)] = number[static_cast<std::size_t>(root)];
    }
  }
  if (kept.size() == above.size()) {
    return model;
  }
  keep_rows(model.mesh.vertices, kept);
  keep_rows(model.skin.joints, kept);
  keep_rows(model.skin.weights, kept);
  for (ShapeParameter& parameter : model.shape) {
    keep_rows(parameter.surface.offsets, kept);
  }
  for (Index i = 0; i < model.mesh.faces.size(); ++i) {
    int& v = model.mesh.faces.data()[i];
    v = number[static_cast<std::size_t>(v)];
  }
  return model;
}

}  // namespace atelier
