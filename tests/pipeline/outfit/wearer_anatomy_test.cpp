#include "pipeline/outfit/wearer_anatomy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/human/default_human.h"
#include "core/error.h"
#include "core/winding_number.h"
#include "registration/template/garment_boundaries.h"

namespace atelier {
namespace {

using ::testing::ElementsAre;

TEST(WearerAnatomy, LimbAxes_StayInsideTheDefaultHuman) {
  const BodyModel model = default_human();
  const BodyAnatomy anatomy = anatomy_of(model);
  check_anatomy(anatomy, vertex_count(model));
  const WindingTree body = build_winding_tree(model.mesh.vertices, model.mesh.faces);
  for (const Extremity extremity : kExtremities) {
    const Points axis = limb_axis(anatomy, extremity, model.mesh.vertices, model.mesh.faces);
    Points inner(10 * (axis.rows() - 2), 3);  // the last segment ends on the skin
    for (Index i = 0; i < inner.rows(); ++i) {
      const double t = static_cast<double>(i % 10) / 10;
      inner.row(i) = (1 - t) * axis.row(i / 10) + t * axis.row(i / 10 + 1);
    }
    Index outside = 0;
    for (const double winding : winding_numbers(body, inner)) {
      outside += winding < 0.5 ? 1 : 0;
    }
    EXPECT_LE(outside, inner.rows() / 20) << static_cast<int>(extremity);
  }
  const Points left =
      limb_axis(anatomy, Extremity::LeftHand, model.mesh.vertices, model.mesh.faces);
  EXPECT_GT(left.bottomRows(1)(0), 0.3);  // left is +X
}

TEST(WearerAnatomy, BodyParts_AreWornAsGarments) {
  // Trunk and upper arms of the body itself: a tee without a gap.
  const BodyModel model = default_human();
  const BodyAnatomy anatomy = anatomy_of(model);
  const auto& arms = anatomy.limbs;
  std::vector<char> worn(anatomy.lumps.size(), 0);
  for (std::size_t v = 0; v < worn.size(); ++v) {
    const int lump = anatomy.lumps[v];
    const auto& head = arms[0];
    const bool trunk = std::find(head.begin() + 1, head.end() - 2, lump) != head.end() - 2;
    bool sleeve = false;
    for (const std::size_t arm : {1, 2}) {
      const auto at = std::find(arms[arm].begin(), arms[arm].end(), lump);
      sleeve =
          sleeve || (at != arms[arm].end() && arms[arm].end() - at >= 3 && at != arms[arm].begin());
    }
    worn[v] = trunk || sleeve ? 1 : 0;
  }
  Triangles faces(model.mesh.faces.rows(), 3);
  Index count = 0;
  for (Index f = 0; f < faces.rows(); ++f) {
    bool all = true;
    for (int k = 0; k < 3; ++k) {
      all = all && worn[static_cast<std::size_t>(model.mesh.faces(f, k))] != 0;
    }
    if (all) {
      faces.row(count++) = model.mesh.faces.row(f);
    }
  }
  faces.conservativeResize(count, 3);
  std::vector<std::string> names =
      garment_boundaries(model.mesh.vertices, faces, anatomy, model.mesh.vertices, model.mesh.faces)
          .names;
  std::sort(names.begin(), names.end());
  EXPECT_THAT(names, ElementsAre("cuff left", "cuff right", "hem", "neck"));
}

TEST(WearerAnatomyRefused, NonHumanSkeleton_Throws) {
  BodyModel model = default_human();
  for (std::string& name : model.skeleton.names) {
    name = "bone " + std::to_string(&name - model.skeleton.names.data());
  }
  std::fill(model.skeleton.parents.begin() + 1, model.skeleton.parents.end(), 0);
  EXPECT_THROW(anatomy_of(model), DataError);
}

TEST(WearerAnatomyRefused, BodyWithUnskinnedLimbs_Throws) {
  BodyModel model = default_human();
  model.skin.joints.setZero();  // all of it goes with the pelvis
  EXPECT_THROW(anatomy_of(model), DataError);
}

}  // namespace
}  // namespace atelier
