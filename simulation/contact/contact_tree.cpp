#include "simulation/contact/contact_tree.h"

#include <algorithm>

#include "core/error.h"

namespace atelier {

template <class T>
ContactTree<T> build_contact_tree(const std::vector<Box<T>>& boxes) {
  ContactTree<T> tree;
  const int n = static_cast<int>(boxes.size());
  if (n == 0) {
    return tree;
  }
  Box<T> bounds = empty_box<T>();
  for (const Box<T>& box : boxes) {
    grow(bounds, T(0.5) * (box.low + box.high));
  }
  std::vector<std::uint64_t> keys(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    keys[i] =
        tree_key(T(0.5) * (boxes[i].low + boxes[i].high), bounds, static_cast<std::uint32_t>(i));
  }
  std::sort(keys.begin(), keys.end());
  const int inner = std::max(1, n - 1);
  tree.nodes.resize(static_cast<std::size_t>(inner));
  tree.node_parent.assign(static_cast<std::size_t>(inner), -1);
  tree.leaf_parent.assign(static_cast<std::size_t>(n), -1);
  const auto primitive = [&](int place) { return static_cast<int>(keys[place] & 0xFFFFFFFFu); };
  if (n == 1) {
    // A root with one child; the other one's box meets nothing.
    tree.nodes[0] = {{boxes[0], empty_box<T>()}, {~0, ~0}};
    tree.leaf_parent[0] = 0;
  } else {
    for (int i = 0; i < inner; ++i) {
      const TreeChildren children = tree_children(keys.data(), n, i);
      const int child[2] = {children.left, children.right};
      for (int side = 0; side < 2; ++side) {
        if (child[side] < 0) {
          tree.nodes[i].child[side] = ~primitive(~child[side]);
          tree.leaf_parent[primitive(~child[side])] = 2 * i + side;
        } else {
          tree.nodes[i].child[side] = child[side];
          tree.node_parent[child[side]] = 2 * i + side;
        }
      }
    }
  }
  tree.bottom_up.push_back(0);
  for (std::size_t head = 0; head < tree.bottom_up.size(); ++head) {
    for (int side = 0; side < 2; ++side) {
      const int child = tree.nodes[tree.bottom_up[head]].child[side];
      if (child > 0) {
        tree.bottom_up.push_back(child);
      }
    }
  }
  std::reverse(tree.bottom_up.begin(), tree.bottom_up.end());
  refit_contact_tree(tree, boxes);
  return tree;
}

template <class T>
void refit_contact_tree(ContactTree<T>& tree, const std::vector<Box<T>>& boxes) {
  ATELIER_CHECK(boxes.size() == tree.leaf_parent.size(), "the tree is of other primitives");
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const TreeParent parent = tree.leaf_parent[i];
    tree.nodes[parent / 2].box[parent % 2] = boxes[i];
  }
  for (int node : tree.bottom_up) {
    const TreeParent parent = tree.node_parent[node];
    if (parent >= 0) {
      tree.nodes[parent / 2].box[parent % 2] =
          united(tree.nodes[node].box[0], tree.nodes[node].box[1]);
    }
  }
}

template ContactTree<float> build_contact_tree(const std::vector<Box<float>>&);
template ContactTree<double> build_contact_tree(const std::vector<Box<double>>&);
template void refit_contact_tree(ContactTree<float>&, const std::vector<Box<float>>&);
template void refit_contact_tree(ContactTree<double>&, const std::vector<Box<double>>&);

}  // namespace atelier
