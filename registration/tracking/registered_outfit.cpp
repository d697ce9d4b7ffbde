#include "registration/tracking/registered_outfit.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/garment_archive.h"
#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/sequence_archive.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

RegisteredGarmentSequence read_one(const JsonPlace& place, const fs::path& template_result,
                                   const fs::path& register_result) {
  RegisteredGarmentSequence one;
  one.name = place.at("label").text();
  const auto label = label_of(one.name);
  if (!label) {
    throw DataError((template_result / "template.json").string(), "label", "'" + one.name + "'",
                    "upper, lower, dress or outer");
  }
  one.label = *label;
  one.template_frame = static_cast<int>(place.at("frame").integer(0, 1000000000));
  const fs::path file = template_result / "garments" / (one.name + ".h5");
  one.garment = read_garment_archive(file);
  const fs::path folder = register_result / "registered" / one.name;
  if (!fs::exists(folder / "sequence.h5")) {
    throw DataError(folder.string(), "", "no registered sequence of this garment",
                    "one of every template; run 'atelier register' again");
  }
  one.registered = open_sequence(folder);
  if (!equal_arrays(one.registered.faces, one.garment.mesh.faces)) {
    throw DataError(folder.string(), "faces", "another topology than the template's",
                    "the template that was registered; run 'atelier register' again");
  }
  return one;
}

}  // namespace

std::vector<RegisteredGarmentSequence> read_registered_outfit(const fs::path& template_result,
                                                              const fs::path& register_result) {
  const fs::path file = template_result / "template.json";
  const nlohmann::json parsed =
      parse_json(read_file_text(file, Limits().text_file_bytes), file.string());
  std::vector<RegisteredGarmentSequence> outfit;
  for (const JsonPlace& place : JsonPlace(parsed, file.string()).items("garments")) {
    outfit.push_back(read_one(place, template_result, register_result));
  }
  if (outfit.empty()) {
    throw DataError(file.string(), "garments", "none", "at least one");
  }
  // From the inside out: what is worn on the hips goes under what hangs over it.
  std::stable_sort(outfit.begin(), outfit.end(), [](const auto& a, const auto& b) {
    return (a.label == Label::Lower) > (b.label == Label::Lower);
  });
  return outfit;
}

Mesh registered_mesh(const RegisteredGarmentSequence& garment, int frame_id) {
  const std::vector<int>& ids = garment.registered.frame_ids;
  const auto at = std::lower_bound(ids.begin(), ids.end(), frame_id);
  if (at == ids.end() || *at != frame_id) {
    throw DataError("", garment.name, "not registered in frame " + std::to_string(frame_id),
                    "a frame of the registered sequence");
  }
  return frame(garment.registered, at - ids.begin());
}

std::vector<int> common_frames(const std::vector<RegisteredGarmentSequence>& outfit) {
  std::vector<int> frames = outfit.empty() ? std::vector<int>{} : outfit[0].registered.frame_ids;
  for (const RegisteredGarmentSequence& garment : outfit) {
    std::vector<int> both;
    std::set_intersection(frames.begin(), frames.end(), garment.registered.frame_ids.begin(),
                          garment.registered.frame_ids.end(), std::back_inserter(both));
    frames = std::move(both);
  }
  return frames;
}

}  // namespace atelier
