#include "simulation/contact/contact_tree.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "core/random.h"

namespace atelier {
namespace {

std::vector<Box<float>> random_boxes(int count, std::uint64_t seed) {
  Random random{seed, 0, 0};
  std::vector<Box<float>> out;
  for (int i = 0; i < count; ++i) {
    const Vec3f p{float(uniform(random)), float(uniform(random)), float(uniform(random))};
    const float size = 0.1f * float(uniform(random));
    out.push_back({p, p + Vec3f{size, size, size}});
  }
  return out;
}

std::vector<int> visited(const ContactTree<float>& tree, const Box<float>& query) {
  std::vector<int> out;
  visit_tree(tree.nodes.data(), query, [&](int i) { out.push_back(i); });
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<int> by_force(const std::vector<Box<float>>& boxes, const Box<float>& query) {
  std::vector<int> out;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (overlap(boxes[i], query)) {
      out.push_back(int(i));
    }
  }
  return out;
}

TEST(ContactTree, RefittedTree_MatchesBruteForce) {
  for (int count : {1, 2, 3, 17, 500}) {
    const std::vector<Box<float>> boxes = random_boxes(count, 1);
    ContactTree<float> tree = build_contact_tree(boxes);
    const std::vector<Box<float>> moved = random_boxes(count, 2);
    for (int q = 0; q < 50; ++q) {
      const Box<float> query = random_boxes(1, 100 + q)[0];
      EXPECT_EQ(visited(tree, query), by_force(boxes, query));
    }
    refit_contact_tree(tree, moved);
    for (int q = 0; q < 50; ++q) {
      const Box<float> query = random_boxes(1, 100 + q)[0];
      EXPECT_EQ(visited(tree, query), by_force(moved, query));
    }
  }
}

TEST(ContactTree, CoincidentBoxes_AreFound) {
  const std::vector<Box<float>> boxes(100, Box<float>{{0, 0, 0}, {1, 1, 1}});
  const ContactTree<float> tree = build_contact_tree(boxes);
  EXPECT_EQ(visited(tree, boxes[0]).size(), 100u);
}

TEST(ContactTree, NoBoxes_GiveAnEmptyTree) {
  EXPECT_TRUE(build_contact_tree(std::vector<Box<float>>{}).nodes.empty());
}

}  // namespace
}  // namespace atelier
