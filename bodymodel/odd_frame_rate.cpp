#include "bodymodel/odd_frame_rate.h"

#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr double kSlow = 1;  // frames a second, between which people are recorded
constexpr double kFast = 1000;
constexpr double kSlowest = 0.01;  // beyond which there is no motion
constexpr double kFastest = 1e5;

// Rates of cameras and of motion capture; NTSC's are within kNear of a whole one.
constexpr double kUsual[] = {12,  15,  20,  24,  25,  30,  48,  50,  60,  72,  75,
                             80,  90,  100, 120, 125, 128, 150, 160, 180, 200, 240,
                             250, 256, 300, 360, 480, 500, 600, 960, 1000};
constexpr double kNear = 0.005;

// What a rate may mean instead.
struct RateReading {
  const char* what;
  double fps;
};

std::vector<RateReading> readings_of(double fps, RateStated stated) {
  if (stated == RateStated::Keys) {
    return {{"milliseconds", 1e3 * fps}, {"microseconds", 1e6 * fps}};
  }
  if (stated == RateStated::Time) {
    return {{"milliseconds", 1e3 * fps},
            {"frames a second in the place of a time", 1 / fps},
            {"microseconds", 1e6 * fps}};
  }
  return {{"the seconds of a frame in the place of a rate", 1 / fps},
          {"kilohertz", 1e3 * fps},
          {"the microseconds of a frame in the place of a rate", 1e6 / fps},
          {"a thousand times the rate", 1e-3 * fps}};
}

// The first reading that is a usual rate, rounded to it.
std::optional<RateReading> likely_reading(double fps, RateStated stated) {
  for (const RateReading& reading : readings_of(fps, stated)) {
    for (const double usual : kUsual) {
      if (std::abs(reading.fps / usual - 1) < kNear) {
        return RateReading{reading.what, usual};
      }
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<Finding> odd_frame_rate(double fps, RateStated stated, const std::string& file) {
  if (fps >= kSlow && fps <= kFast) {
    return std::nullopt;
  }
  std::string found = short_number(fps) + " frames a second";
  if (stated != RateStated::Rate && fps > 0) {
    found += ", " + short_number(1 / fps) + " s each";
  }
  std::string fps_set = "--motion.fps RATE";
  if (const std::optional<RateReading> likely = likely_reading(fps, stated)) {
    found += std::string("; it looks like ") + likely->what;
    fps_set = "--motion.fps " + short_number(likely->fps);
  }
  const std::string advice = stated == RateStated::Keys
                                 ? "write its times in seconds"
                                 : fps_set + " of body-model sets it, and convert writes it so";
  if (!(fps >= kSlowest && fps <= kFastest)) {
    throw DataError(file, "frame rate", found,
                    "a motion's, 0.01 to 100,000 frames a second; " + advice);
  }
  return Finding{Severity::Warning, "fps-odd", file, found, "no person is recorded so; " + advice};
}

}  // namespace atelier
