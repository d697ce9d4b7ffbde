#include "pipeline/capture/input_measures.h"

#include <algorithm>
#include <string>

#include "capture/capture_info.h"
#include "capture/masks/background.h"
#include "capture/surface/color_gains.h"
#include "core/error.h"
#include "core/io/cameras_file.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/limits.h"

namespace atelier {

std::vector<Measure> measure_masks(const std::filesystem::path& folder,
                                   const std::filesystem::path& capture) {
  const CaptureInfo info = read_capture_info(capture);
  double sum = 0;
  double least = 1;
  int judged = 0;
  int missing = 0;
  for (const Camera& camera : read_ground_truth(capture).cameras) {
    for (const CaptureSequence& sequence : info.sequences) {
      for (const int id : sequence.frame_ids) {
        const std::filesystem::path name =
            std::filesystem::path("labels") / camera.id / (frame_name(id) + ".png");
        if (!std::filesystem::exists(folder / name)) {
          ++missing;
          continue;
        }
        const ByteImage mask = read_labels(folder / name);
        const ByteImage truth = read_labels(capture / "truth" / name);
        if (mask.width != truth.width || mask.height != truth.height) {
          throw DataError(
              (folder / name).string(), "",
              std::to_string(mask.width) + " x " + std::to_string(mask.height) + " pixels",
              std::to_string(truth.width) + " x " + std::to_string(truth.height));
        }
        const double iou = mask_iou(mask, truth);
        sum += iou;
        least = std::min(least, iou);
        ++judged;
      }
    }
  }
  if (judged == 0) {
    throw DataError((folder / "labels").string(), "", "no mask of an image of the capture",
                    "<camera>/<frame>.png, as atelier masks --out writes them");
  }
  const std::string over =
      std::to_string(judged) + " images" +
      (missing > 0 ? ", " + std::to_string(missing) + " have no mask" : std::string());
  return {{"masks.iou", sum / judged, "", 0, Measure::Side::None, "mean over " + over},
          {"masks.iou_min", least, "", 0, Measure::Side::None, "of one image"}};
}

std::vector<Measure> measure_gains(const std::filesystem::path& cameras,
                                   const std::filesystem::path& capture) {
  const GainError error = gain_error(
      parse_cameras_json(read_file_text(cameras, Limits().text_file_bytes), cameras.string()),
      read_ground_truth(capture).cameras);
  return {{"calibration.gain_mean", error.mean, "", 0, Measure::Side::None,
           "mean error of the gains, as a share, but for a factor on all"},
          {"calibration.gain_largest", error.largest, "", 0, Measure::Side::None, "the largest"}};
}

}  // namespace atelier
