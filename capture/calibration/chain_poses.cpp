#include "capture/calibration/chain_poses.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/median.h"

namespace atelier {
namespace {

/// The relative pose of a pair and the frames that agree.
struct Link {
  RigidNumbers a_from_b = RigidNumbers::Zero();
  int frames = 0;
  double rms = std::numeric_limits<double>::infinity();  ///< of the frames that agree
};

/// Pixel error of the view of `a` if the board is where `b` sees it: the better of b's poses.
double transfer_rms(const Camera& camera_a, const PosedView& a, const PosedView& b,
                    const RigidNumbers& a_from_b, const BoardPoints& points) {
  double least = std::numeric_limits<double>::infinity();
  for (const BoardPose& pose : b.poses) {
    least = std::min(least,
                     pose_rms(camera_a, a.view, points, chained(a_from_b, pose.camera_from_board)));
  }
  return least;
}

Link link_of(const Camera& camera_a, const Camera& camera_b,
             const std::vector<std::pair<const PosedView*, const PosedView*>>& both,
             const BoardPoints& points, double tolerance) {
  constexpr std::size_t kMaxFrames = 40;
  const std::size_t step = std::max<std::size_t>(1, both.size() / kMaxFrames);
  Link best;
  for (std::size_t proposer = 0; proposer < both.size(); proposer += step) {
    for (const BoardPose& pose_a : both[proposer].first->poses) {
      for (const BoardPose& pose_b : both[proposer].second->poses) {
        Link link;
        link.a_from_b = chained(pose_a.camera_from_board, inverse_of(pose_b.camera_from_board));
        double sum = 0;
        for (std::size_t voter = 0; voter < both.size(); voter += step) {
          const auto& [a, b] = both[voter];
          const double there = transfer_rms(camera_a, *a, *b, link.a_from_b, points);
          const double back = transfer_rms(camera_b, *b, *a, inverse_of(link.a_from_b), points);
          const double rms = std::max(there, back);
          if (rms < tolerance) {
            link.frames += 1;
            sum += rms;
          }
        }
        link.rms = link.frames > 0 ? sum / link.frames : link.rms;
        if (link.frames > best.frames || (link.frames == best.frames && link.rms < best.rms)) {
          best = link;
        }
      }
    }
  }
  if (best.frames > 1) {
    best.frames *= static_cast<int>(step);
  }
  return best;
}

/// Cameras that hang together through links, the largest group.
std::vector<bool> largest_group(const std::vector<std::vector<Link>>& links) {
  const std::size_t count = links.size();
  std::vector<int> group(count, -1);
  std::vector<int> sizes;
  for (std::size_t seed = 0; seed < count; ++seed) {
    if (group[seed] >= 0) {
      continue;
    }
    const int number = static_cast<int>(sizes.size());
    sizes.push_back(0);
    std::vector<std::size_t> open = {seed};
    group[seed] = number;
    while (!open.empty()) {
      const std::size_t c = open.back();
      open.pop_back();
      sizes.back() += 1;
      for (std::size_t d = 0; d < count; ++d) {
        if (group[d] < 0 && links[c][d].frames > 0) {
          group[d] = number;
          open.push_back(d);
        }
      }
    }
  }
  const auto largest = std::max_element(sizes.begin(), sizes.end()) - sizes.begin();
  std::vector<bool> inside(count);
  for (std::size_t c = 0; c < count; ++c) {
    inside[c] = group[c] == largest && (sizes[static_cast<std::size_t>(largest)] > 1);
  }
  return inside;
}

}  // namespace

PoseChain chain_poses(const std::vector<Camera>& cameras, const std::vector<PosedView>& views,
                      const BoardPoints& points, double tolerance) {
  const std::size_t count = cameras.size();
  std::map<int, std::vector<const PosedView*>> by_frame;
  for (const PosedView& view : views) {
    ATELIER_CHECK(view.view.camera_idx >= 0 && view.view.camera_idx < static_cast<int>(count) &&
                      !view.poses.empty(),
                  "a view of a camera that is not there, or without a pose");
    by_frame[view.view.frame_id].push_back(&view);
  }
  std::vector<std::vector<Link>> links(count, std::vector<Link>(count));
  PoseChain chain;
  chain.shared.assign(count, std::vector<int>(count, 0));
  chain.out_of_step = chain.shared;
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = a + 1; b < count; ++b) {
      std::vector<std::pair<const PosedView*, const PosedView*>> both;
      for (const auto& [frame, seen] : by_frame) {
        const auto of = [&](std::size_t c) {
          const auto found = std::find_if(seen.begin(), seen.end(), [&](const PosedView* view) {
            return view->view.camera_idx == static_cast<int>(c);
          });
          return found == seen.end() ? nullptr : *found;
        };
        if (of(a) != nullptr && of(b) != nullptr) {
          both.emplace_back(of(a), of(b));
        }
      }
      if (both.empty()) {
        continue;
      }
      links[a][b] = link_of(cameras[a], cameras[b], both, points, tolerance);
      constexpr std::size_t kDisagreeing = 3;  // a frame always agrees with itself
      if (both.size() >= kDisagreeing && links[a][b].frames < 2) {
        links[a][b] = {};
        chain.out_of_step[a][b] = chain.out_of_step[b][a] = static_cast<int>(both.size());
      }
      links[b][a] = links[a][b];
      links[b][a].a_from_b = inverse_of(links[a][b].a_from_b);
      chain.shared[a][b] = chain.shared[b][a] = links[a][b].frames;
    }
  }
  chain.in_rig = largest_group(links);
  chain.camera_from_world.assign(count, RigidNumbers::Zero());
  // The root is the camera with the most frames in common with others.
  std::size_t root = count;
  int most = -1;
  for (std::size_t c = 0; c < count; ++c) {
    int frames = 0;
    for (const Link& link : links[c]) {
      frames += link.frames;
    }
    if (chain.in_rig[c] && frames > most) {
      most = frames;
      root = c;
    }
  }
  if (root == count) {
    return chain;
  }
  std::vector<bool> placed(count, false);
  placed[root] = true;
  for (;;) {
    std::size_t from = count;
    std::size_t to = count;
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = 0; b < count; ++b) {
        if (!placed[a] || placed[b] || links[a][b].frames == 0) {
          continue;
        }
        if (from == count || links[a][b].frames > links[from][to].frames ||
            (links[a][b].frames == links[from][to].frames &&
             links[a][b].rms < links[from][to].rms)) {
          from = a;
          to = b;
        }
      }
    }
    if (from == count) {
      break;
    }
    chain.camera_from_world[to] = chained(links[to][from].a_from_b, chain.camera_from_world[from]);
    placed[to] = true;
  }
  for (const auto& [frame, seen] : by_frame) {
    double least = std::numeric_limits<double>::infinity();
    for (const PosedView* view : seen) {
      const auto c = static_cast<std::size_t>(view->view.camera_idx);
      if (!chain.in_rig[c]) {
        continue;
      }
      for (const BoardPose& pose : view->poses) {
        const RigidNumbers world_from_board =
            chained(inverse_of(chain.camera_from_world[c]), pose.camera_from_board);
        std::vector<double> errors;
        for (const PosedView* other : seen) {
          const auto d = static_cast<std::size_t>(other->view.camera_idx);
          if (chain.in_rig[d]) {
            errors.push_back(pose_rms(cameras[d], other->view, points,
                                      chained(chain.camera_from_world[d], world_from_board)));
          }
        }
        const double error = median(errors);
        if (error < least) {
          least = error;
          chain.world_from_board[frame] = world_from_board;
        }
      }
    }
  }
  return chain;
}

}  // namespace atelier
