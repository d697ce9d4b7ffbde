// How often validate is right on rigs that nobody looked at when it was written: the seeded defects
// on rigs of drawn sizes, lenses, distances and gaits, with calibrations that are a little off; and
// good captures, small ones too. ATELIER_SOAK=1 draws many (ATELIER_SOAK_RIGS: how many) and prints
// the rates: ATELIER_SOAK=1 test_capture --gtest_filter='SeededRates.*'

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>

#include <gtest/gtest.h>

#include "capture/validate.h"
#include "core/random.h"
#include "tests/capture/seeded_defects.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

bool soak() {
  return std::getenv("ATELIER_SOAK") != nullptr;
}

int drawn(int sampled, int soaked) {
  const char* rigs = std::getenv("ATELIER_SOAK_RIGS");
  return !soak() ? sampled : rigs != nullptr ? std::atoi(rigs) : soaked;
}

/// A rig of a kind of seeded_rigs(), with other random numbers.
SeededRig drawn_rig(SeededRig rig, std::uint64_t seed, bool more_cameras) {
  Random random{seed, 555, 0};
  rig.seed = 10000 + seed;
  const double farther = uniform(random, 1, 1.5);
  rig.circle.radius *= farther;
  rig.circle.focal *= farther * uniform(random, 0.85, 1.05);
  rig.circle.low *= uniform(random, 0.7, 1.3);
  rig.circle.high *= uniform(random, 0.85, 1.3);
  rig.circle.count += more_cameras ? static_cast<int>(uniform_index(random, 4)) : 0;
  const double bent = uniform(random, 0.6, 1);
  for (double& coefficient : rig.distortion) {
    coefficient *= bent;
  }
  rig.noise = uniform(random, 1.5, 4);
  rig.fps = uniform_index(random, 2) == 0 ? 30 : 50;  // nobody walks out of the image
  rig.frames += static_cast<int>(uniform_index(random, 5));
  rig.stature = uniform(random, 1.5, 1.95);
  return rig;
}

/// Calibrations are a little off: 0.3 px of 1000 rows, and a millimetre.
void unsettle(std::vector<Camera>& cameras, std::uint64_t seed) {
  Random random{seed, 556, 0};
  for (Camera& camera : cameras) {
    const auto draw = [&] {
      return Eigen::Vector3d(normal(random), normal(random), normal(random));
    };
    const Eigen::Vector3d centre = camera_center(camera) + 0.001 * draw();
    const Eigen::Vector3d turn = 0.0003 * camera.height / camera.fx * draw();
    camera.camera_from_world_rotation =
        Eigen::AngleAxisd(turn.norm(), turn.normalized()) * camera.camera_from_world_rotation;
    camera.camera_from_world_translation = -camera.camera_from_world_rotation * centre;
  }
}

struct Rate {
  int tried = 0;
  int named = 0;
  int setting = 0;  ///< that puts it right was advised
  int blamed = 0;   ///< captures in which another camera got an error
};

TEST(SeededRates, DefectsOnRandomRigs_MeetDetectionRates) {
  const int rigs = drawn(1, 20);
  const std::vector<SeededDefect> defects = all_defects();
  std::vector<Rate> rates(defects.size());
  Rate all;
  int settings = 0;
  for (int i = 0; i < rigs; ++i) {
    const auto seed = static_cast<std::uint64_t>(1000 + i);
    std::map<int, std::pair<SeededRig, SeededCapture>> good;
    for (std::size_t d = 0; d < defects.size(); ++d) {
      constexpr std::size_t kSome = 9;
      if (!soak() && d % kSome != 0) {
        continue;
      }
      const SeededDefect& defect = defects[d];
      if (good.count(defect.rig) == 0) {
        const SeededRig rig =
            drawn_rig(seeded_rigs()[static_cast<std::size_t>(defect.rig)], seed, defect.rig != 1);
        SeededCapture capture = seeded_capture(rig);
        unsettle(capture.cameras, seed);
        good[defect.rig] = {rig, std::move(capture)};
      }
      TemporaryDirectory folder;
      write_spoiled(defect, {good[defect.rig].first, good[defect.rig].second, folder.path()});
      const std::vector<Finding> findings = findings_of(folder.path());
      const std::vector<std::string> advised = settings_of(findings);
      Rate& rate = rates[d];
      ++rate.tried;
      const bool named = std::any_of(findings.begin(), findings.end(),
                                     [&](const Finding& f) { return names(f, defect); });
      rate.named += named ? 1 : 0;
      rate.setting +=
          std::find(advised.begin(), advised.end(), defect.setting) != advised.end() ? 1 : 0;
      const auto other = std::find_if(findings.begin(), findings.end(),
                                      [&](const Finding& f) { return blames_another(f, defect); });
      rate.blamed += other != findings.end() ? 1 : 0;
      if (!named) {
        std::printf("%s, seed %d: not named, but:\n", defect.what, static_cast<int>(seed));
        for (const Finding& finding : findings) {
          std::printf("    %s\n", to_string(finding).c_str());
        }
      }
      if (other != findings.end()) {
        std::printf("%s, seed %d: also %s\n", defect.what, static_cast<int>(seed),
                    to_string(*other).c_str());
      }
    }
  }
  for (std::size_t d = 0; d < defects.size(); ++d) {
    const bool set = *defects[d].setting != '\0';
    all.tried += rates[d].tried;
    all.named += rates[d].named;
    all.blamed += rates[d].blamed;
    all.setting += set ? rates[d].setting : 0;
    settings += set ? rates[d].tried : 0;
    if (rates[d].named < rates[d].tried || rates[d].blamed > 0 ||
        (set && rates[d].setting < rates[d].tried)) {
      std::printf("%-66s named %d of %d, setting %d, another blamed %d\n", defects[d].what,
                  rates[d].named, rates[d].tried, rates[d].setting, rates[d].blamed);
    }
  }
  std::printf("all: named %d of %d, the setting advised %d of %d, another camera blamed %d\n",
              all.named, all.tried, all.setting, settings, all.blamed);
  EXPECT_GE(all.named, 0.9 * all.tried);
  EXPECT_GE(all.setting, 0.8 * settings);
  EXPECT_LE(all.blamed, 0.02 * all.tried);
}

/// A small rig of a poor detector: lenses that bend some, calibrations a little off.
SeededRig small_noisy_rig(std::uint64_t seed) {
  Random random{seed, 558, 0};
  SeededRig rig;
  rig.circle = {.count = 3 + static_cast<int>(uniform_index(random, 3)),
                .width = 960,
                .height = 720,
                .focal = uniform(random, 600, 900),
                .radius = uniform(random, 2.4, 3.6)};
  rig.distortion = {uniform(random, -0.3, 0.1), uniform(random, -0.05, 0.12),
                    uniform(random, -0.002, 0.002), uniform(random, -0.002, 0.002),
                    uniform(random, -0.05, 0.02)};
  rig.noise = uniform(random, 3, 6);
  rig.frames = 5 + static_cast<int>(uniform_index(random, 26));
  rig.seed = 20000 + seed;
  rig.pictures = false;
  return rig;
}

/// Distortions as files have them that are meant by a reading of --capture.distortion.
void write_otherwise(Camera& camera, const std::string& meant) {
  std::array<double, 8>& d = camera.distortion;
  if (meant == "k3_third") {
    d = {d[0], d[1], d[4], d[2], d[3]};  // k1 k2 k3 p1 p2
  } else if (meant != "none") {
    const double factor = meant == "negated" ? -1 : meant == "by_64" ? 64 : 1 / 64.0;
    for (double& number : d) {
      number *= factor;
    }
  }
}

/// Distortion shifts pixels by less than a poor detector errs: what few cameras cannot tell is not
/// advised.
TEST(SeededRates, DistortionOfSmallNoisyRigs_IsAdvisedOnlyWhereItIsRight) {
  const int rigs = drawn(6, 100);
  std::map<std::string, Rate> rates;
  int wrong = 0;
  int tried = 0;
  for (int i = 0; i < rigs; ++i) {
    const auto seed = static_cast<std::uint64_t>(5000 + i);
    const SeededRig rig = small_noisy_rig(seed);
    for (const std::string meant : {"", "negated", "by_64", "times_64", "k3_third", "none"}) {
      SeededRig seen = rig;
      if (meant == "none") {
        seen.distortion = {};
      }
      SeededCapture capture = seeded_capture(seen);
      for (std::size_t c = 0; c < capture.cameras.size(); ++c) {
        std::copy(rig.distortion.begin(), rig.distortion.end(),
                  capture.cameras[c].distortion.begin());
        capture.cameras[c].distortion_model = Distortion::Brown;
        if (!meant.empty()) {
          write_otherwise(capture.cameras[c], meant);
        }
      }
      unsettle(capture.cameras, seed);
      const TemporaryDirectory folder;
      write_seeded(capture, folder.path());
      Rate& rate = rates[meant];
      ++rate.tried;
      ++tried;
      for (const std::string& setting : settings_of(findings_of(folder.path()))) {
        if (!setting.starts_with("--capture.distortion")) {
          continue;
        }
        const bool right = !meant.empty() && setting == "--capture.distortion all=" + meant;
        rate.setting += right ? 1 : 0;
        rate.blamed += right ? 0 : 1;
        wrong += right ? 0 : 1;
        if (!right) {
          std::printf("seed %d, %d cameras, %d frames, %.1f px, k1 %.2f, meant '%s': %s\n",
                      static_cast<int>(seed), rig.circle.count, rig.frames, rig.noise,
                      rig.distortion[0], meant.c_str(), setting.c_str());
        }
      }
    }
  }
  // A wrong correction of a capture that is right is to be taken away, or nothing is said.
  for (int i = 0; i < rigs; ++i) {
    const SeededRig rig = small_noisy_rig(static_cast<std::uint64_t>(5000 + i));
    const TemporaryDirectory folder;
    SeededCapture capture = seeded_capture(rig);
    unsettle(capture.cameras, rig.seed);
    write_seeded(capture, folder.path());
    for (const std::string given : {"negated", "by_64", "times_64", "k3_third", "none"}) {
      ++tried;
      for (const std::string& setting :
           settings_of(findings_of(folder.path(), "--capture.distortion all=" + given))) {
        if (setting.starts_with("--capture.distortion")) {
          ++wrong;
          std::printf("seed %d, given '%s': %s\n", 5000 + i, given.c_str(), setting.c_str());
        }
      }
    }
  }
  for (const auto& [meant, rate] : rates) {
    std::printf("distortion %-9s of %d small rigs: advised rightly %d, wrongly %d\n",
                meant.empty() ? "as read" : meant.c_str(), rate.tried, rate.setting, rate.blamed);
  }
  EXPECT_LE(wrong, 0.01 * tried);
}

/// Good captures of detections alone: 2 to 12 cameras, of a whole circle or an arc, 1 to 40 frames,
/// somebody who walks or stands, detectors good and bad.
TEST(SeededRates, GoodRandomCaptures_RarelyGiveFindings) {
  const int captures = drawn(12, 600);
  std::map<std::string, int> counts;
  int errors = 0;
  int warnings = 0;
  for (int i = 0; i < captures; ++i) {
    const auto seed = static_cast<std::uint64_t>(3000 + i);
    Random random{seed, 557, 0};
    SeededRig rig = drawn_rig(seeded_rigs()[2], seed, false);
    const auto count = 2 + uniform_index(random, 11);
    rig.circle.count = static_cast<int>(count + uniform_index(random, 12));
    rig.frames =
        1 + static_cast<int>(uniform_index(random, uniform_index(random, 2) == 0 ? 4 : 40));
    rig.noise = uniform(random, 1, 6);
    constexpr double kRates[] = {24, 30, 50, 1000};  // the last: stands all but still
    rig.fps = kRates[uniform_index(random, 4)];
    SeededCapture capture = seeded_capture(rig);
    unsettle(capture.cameras, seed);
    capture.cameras.resize(count);
    capture.keypoints.resize(count);
    TemporaryDirectory folder;
    write_seeded(capture, folder.path());
    bool error = false;
    bool warning = false;
    for (const Finding& finding : findings_of(folder.path())) {
      if (finding.code == "camera-without-pictures" || finding.severity == Severity::Note) {
        continue;
      }
      (finding.severity == Severity::Error ? error : warning) = true;
      ++counts[std::string(severity_name(finding.severity)) + " " + finding.code];
      std::printf("seed %d, %zu cameras of %d in the circle, %d frames at %g, %.1f px: %s\n",
                  static_cast<int>(seed), capture.cameras.size(), rig.circle.count, rig.frames,
                  rig.fps, rig.noise, to_string(finding).c_str());
    }
    errors += error ? 1 : 0;
    warnings += warning ? 1 : 0;
  }
  for (const auto& [code, count] : counts) {
    std::printf("%4d %s\n", count, code.c_str());
  }
  std::printf("of %d good captures %d have an error, %d a warning\n", captures, errors, warnings);
  EXPECT_LE(errors, 0.01 * captures);
  EXPECT_LE(warnings, 0.05 * captures);
}

}  // namespace
}  // namespace atelier::fixtures
