#include "bodymodel/formats/marker_subjects.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/marker_fit.h"
#include "core/error.h"
#include "tests/bodymodel/synthetic_markers.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

using fixtures::joint_centre_names;
using fixtures::marked_person;
using fixtures::MarkedPerson;
using fixtures::opensim_names;
using fixtures::plug_in_gait_names;

bool is_told(const std::vector<Finding>& findings, const std::string& code) {
  return std::any_of(findings.begin(), findings.end(),
                     [&](const Finding& finding) { return finding.code == code; });
}

/// A clip with a second person in it, a step aside, named as `ada` and `ben` say.
MarkerClip two_people(const MarkedPerson& person, const std::string& ada, const std::string& ben) {
  MarkerClip clip = person.clip;
  const std::size_t count = clip.markers.size();
  for (std::size_t m = 0; m < count; ++m) {
    const std::string name = clip.markers[m];
    clip.markers[m] = ada + name;
    clip.markers.push_back(ben + name);
  }
  for (std::size_t f = 0; f < clip.positions.size(); ++f) {
    Points both(2 * static_cast<Index>(count), 3);
    both << clip.positions[f], clip.positions[f].rowwise() + Eigen::RowVector3d(2, 0, 0);
    clip.positions[f] = both;
    const std::vector<bool> seen = clip.seen[f];
    clip.seen[f].insert(clip.seen[f].end(), seen.begin(), seen.end());
  }
  return clip;
}

TEST(MarkerSubjects, PrefixOfAnySign_IsASubject) {
  for (const auto& names : {plug_in_gait_names(), opensim_names(), joint_centre_names()}) {
    const MarkedPerson person = marked_person(names);
    for (const auto& [ada, ben] : {std::pair("A_", "B_"),
                                   {"Ada.", "Ben."},
                                   {"Ada ", "Ben "},
                                   {"Subject_1_", "Subject_2_"},
                                   {"P1-", "P2-"}}) {
      MarkerClip clip = two_people(person, ada, ben);
      name_subjects(clip);
      EXPECT_EQ(marker_subject(clip.markers.front()) + clip.markers.back(),
                std::string(ada).substr(0, std::string(ada).size() - 1) +
                    std::string(ben).substr(0, std::string(ben).size() - 1) + ":" + names.back());
      EXPECT_TRUE(is_told(clip.findings, "motion-markers-names"));
      ATELIER_EXPECT_REFUSED(fit_markers(clip, {}, {}), DataError, "markers of 2 subjects");
    }
  }
}

TEST(MarkerSubjects, NamesOfOnePerson_AreLeft) {
  for (const auto& names : {plug_in_gait_names(), opensim_names(), joint_centre_names()}) {
    MarkerClip clip = marked_person(names).clip;
    name_subjects(clip);
    EXPECT_EQ(clip.markers, names);
    EXPECT_TRUE(clip.findings.empty());
  }
  MarkerClip clip = marked_person(plug_in_gait_names()).clip;
  for (std::string& name : clip.markers) {  // sides before a sign are no people
    name = (name[0] == 'L' || name[0] == 'R') ? name.substr(0, 1) + "_" + name.substr(1) : name;
  }
  const std::vector<std::string> as_they_are = clip.markers;
  name_subjects(clip);
  EXPECT_EQ(clip.markers, as_they_are);
}

TEST(MarkerSubjects, MirrorImage_IsTold) {
  for (const auto& names : {plug_in_gait_names(), opensim_names(), joint_centre_names()}) {
    MarkerClip clip = marked_person(names).clip;
    MarkerFitOptions quick;
    quick.rounds = 1;
    quick.calibration_frames = 5;
    EXPECT_FALSE(is_told(fit_markers(clip, {}, quick).clip.findings, "motion-mirrored"));
    for (Points& positions : clip.positions) {
      positions.col(0) *= -1;
    }
    EXPECT_TRUE(is_told(fit_markers(clip, {}, quick).clip.findings, "motion-mirrored"));
    for (std::string& name : clip.markers) {  // with its sides exchanged it is a person again
      if (name[0] == 'L' || name[0] == 'R') {
        name[0] = name[0] == 'L' ? 'R' : 'L';
      }
    }
    EXPECT_FALSE(is_told(fit_markers(clip, {}, quick).clip.findings, "motion-mirrored"));
  }
}

}  // namespace
}  // namespace atelier
