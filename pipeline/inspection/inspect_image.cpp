#include <algorithm>
#include <optional>
#include <string>

#include "core/io/image_file.h"
#include "pipeline/inspection/inspection.h"

namespace atelier {

void inspect_image(const std::filesystem::path& path, Inspection& inspection) {
  const ImageHeader header = read_image_header(path);
  inspection.add("kind", std::string("image, ") + format_name(header.format));
  inspection.add("width", header.width, "px");
  inspection.add("height", header.height, "px");
  inspection.add("channels", header.channels);
  inspection.add("bits", header.bit_depth, header.palette ? "of a palette's index" : "a sample");
  const Image image = read_image(path);  // a damaged file is refused here
  std::vector<float> low(static_cast<std::size_t>(image.channels), 1.0f);
  std::vector<float> high(low.size(), 0.0f);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    low[i % low.size()] = std::min(low[i % low.size()], image.data[i]);
    high[i % low.size()] = std::max(high[i % low.size()], image.data[i]);
  }
  for (std::size_t c = 0; c < low.size(); ++c) {
    inspection.add("channel " + std::to_string(c), nlohmann::ordered_json::array({low[c], high[c]}),
                   "linear");
  }
  const std::optional<ImageFormat> named = image_format_of_name(path);
  if (named && *named != header.format) {
    inspection.findings.push_back({Severity::Note, "image-name", path.string(),
                                   std::string("the name says ") + format_name(*named) +
                                       ", the content is " + format_name(header.format),
                                   "rename it: some programs go by the name"});
  }
  if (header.orientation != 1) {
    inspection.findings.push_back(
        {Severity::Warning, "image-orientation", path.string(),
         "EXIF orientation " + std::to_string(header.orientation) + " is not applied",
         "store the pixels as the camera was calibrated"});
  }
}

}  // namespace atelier
