#include "bodymodel/formats/marker_subjects.h"

#include <Eigen/Geometry>
#include <map>
#include <string>

#include "bodymodel/formats/marker_names.h"
#include "core/printable.h"

namespace atelier {
namespace {

constexpr int kFewestOfSubject = 6;
constexpr const char* kSigns = "_. -|/";

/// Bytes before the sign behind which a name means a place on a person; npos of none.
std::size_t subject_end(const std::string& name) {
  for (std::size_t at = name.find_first_of(kSigns); at != std::string::npos;
       at = name.find_first_of(kSigns, at + 1)) {
    if (at > 0 && marker_place(name.substr(at + 1))) {
      return at;
    }
  }
  return std::string::npos;
}

/// Where a person looks, by what is left and right, times where markers of one part say: below 0
/// if they disagree; 0 if nothing is seen.
double agreement_in(const MarkerClip& clip, std::size_t frame, const PlacedMarkers& markers) {
  constexpr double kAside = 0.05;  // m
  constexpr double kAhead = 0.06;
  Eigen::RowVector3d left = Eigen::RowVector3d::Zero();
  Eigen::RowVector3d right = Eigen::RowVector3d::Zero();
  int lefts = 0;
  int rights = 0;
  Eigen::RowVector3d ahead = Eigen::RowVector3d::Zero();
  const auto seen = [&](std::size_t m) {
    return clip.seen[frame][static_cast<std::size_t>(markers.columns[m])];
  };
  const auto place = [&](std::size_t m) { return clip.positions[frame].row(markers.columns[m]); };
  for (std::size_t m = 0; m < markers.columns.size(); ++m) {
    const double x = markers.rest(static_cast<Index>(m), 0);
    if (!seen(m)) {
      continue;
    }
    if (x > kAside) {
      left += place(m);
      ++lefts;
    } else if (x < -kAside) {
      right += place(m);
      ++rights;
    }
    for (std::size_t other = 0; other < markers.columns.size(); ++other) {
      if (markers.segments[m] == markers.segments[other] && seen(other) &&
          markers.rest(static_cast<Index>(m), 2) >
              markers.rest(static_cast<Index>(other), 2) + kAhead) {
        ahead += place(m) - place(other);
      }
    }
  }
  if (lefts == 0 || rights == 0) {
    return 0;
  }
  const Eigen::Vector3d to_left = (left / lefts - right / rights).transpose();
  return to_left.cross(Eigen::Vector3d::UnitY()).dot(ahead.transpose());
}

}  // namespace

void name_subjects(MarkerClip& clip) {
  int whole = 0;
  std::map<std::string, int> known;  // by subject and its sign
  for (const std::string& name : clip.markers) {
    if (name.find(':') != std::string::npos) {
      return;
    }
    whole += marker_place(name) ? 1 : 0;
    if (const std::size_t end = subject_end(name); end != std::string::npos) {
      ++known[name.substr(0, end + 1)];
    }
  }
  int behind = 0;
  std::erase_if(known, [](const auto& one) { return one.second < kFewestOfSubject; });
  for (const auto& [subject, count] : known) {
    behind += count;
  }
  if (behind == 0 || 2 * whole > behind) {
    return;
  }
  std::string first;
  for (std::string& name : clip.markers) {
    for (const auto& [subject, count] : known) {
      if (name.starts_with(subject) && name.size() > subject.size()) {
        first = first.empty() ? name : first;
        name[subject.size() - 1] = ':';
        break;
      }
    }
  }
  clip.findings.push_back(
      {Severity::Note, "motion-markers-names", clip.name,
       "names are those of a subject and a marker, as in " + first.substr(0, 40),
       "taken as if a colon stood between them"});
}

std::optional<Finding> mirrored_finding(const MarkerClip& clip, const PlacedMarkers& markers) {
  constexpr int kFewestFrames = 5;
  constexpr double kMostFrames = 0.8;
  int asked = 0;
  int against = 0;
  for (std::size_t frame = 0; frame < clip.positions.size(); ++frame) {
    const double agreement = agreement_in(clip, frame, markers);
    asked += agreement != 0 ? 1 : 0;
    against += agreement < 0 ? 1 : 0;
  }
  if (asked < kFewestFrames || against < kMostFrames * asked) {
    return std::nullopt;
  }
  return Finding{
      Severity::Warning, "motion-mirrored", clip.name,
      "the markers ahead are behind, of somebody whose left markers are on the left: the "
      "recording is a mirror image, or left and right are in each other's place",
      "export it without mirroring, or exchange the names of left and right"};
}

}  // namespace atelier
