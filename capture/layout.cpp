#include "capture/layout.h"

#include <algorithm>
#include <charconv>
#include <system_error>

#include "capture/cameras_file.h"
#include "capture/layout_source.h"
#include "capture/truth_archive.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

struct Layout {
  const char* name;
  std::vector<std::string> (*write)(const LayoutSource&, const fs::path&);
};

constexpr Layout kLayouts[] = {{"easymocap", write_easymocap}, {"colmap", write_colmap},
                               {"panoptic", write_panoptic},   {"dna", write_dna},
                               {"actorshq", write_actorshq},   {"nerfstudio", write_nerfstudio}};

}  // namespace

fs::path LayoutSource::image(const Camera& camera, int frame) const {
  return capture / "images" / camera.id / (frame_name(frame) + "." + info.image_format);
}

fs::path LayoutSource::labels(const Camera& camera, int frame) const {
  return capture / "labels" / camera.id / (frame_name(frame) + ".png");
}

fs::path LayoutSource::keypoints(const Camera& camera, int frame) const {
  return capture / "keypoints2d" / camera.id / (frame_name(frame) + ".json");
}

void link_file(const fs::path& from, const fs::path& to) {
  make_private_directory(to.parent_path());
  std::error_code error;
  fs::create_hard_link(from, to, error);
  if (!error) {
    return;
  }
  const std::vector<std::byte> bytes = read_file_bytes(from, Limits{}.image_file_bytes);
  AtomicFile file(to);
  file.write(bytes);
  file.commit();
}

void write_mask(const fs::path& labels, const fs::path& to) {
  if (!fs::exists(labels)) {
    return;
  }
  ByteImage mask = read_labels(labels);
  for (std::uint8_t& value : mask.data) {
    value = value == 0 ? 0 : 255;
  }
  make_private_directory(to.parent_path());
  write_image(to, mask);
}

std::string number_text(double value) {
  char text[32];
  const auto [end, error] = std::to_chars(text, text + sizeof(text), value);
  ATELIER_CHECK(error == std::errc(), "a number that has no text");
  return {text, end};
}

const std::vector<std::string>& layout_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const Layout& layout : kLayouts) {
      result.emplace_back(layout.name);
    }
    return result;
  }();
  return names;
}

LayoutReport write_layout(const fs::path& capture, const std::string& layout, const fs::path& out) {
  const auto* found = std::find_if(std::begin(kLayouts), std::end(kLayouts),
                                   [&](const Layout& known) { return known.name == layout; });
  ATELIER_CHECK(found != std::end(kLayouts), "no layout is called " + layout);
  LayoutSource source;
  source.capture = capture;
  source.info = read_capture_info(capture);
  source.cameras = read_cameras(capture);
  if (fs::exists(out)) {
    throw EnvironmentError(out.string(), "it is there already; name a new folder");
  }
  LayoutReport report;
  for (const CaptureSequence& sequence : source.info.sequences) {
    source.sequence = sequence;
    const fs::path folder = out / sequence.name;
    make_private_directory(folder);
    for (const std::string& sentence : found->write(source, folder)) {
      if (std::find(report.lost.begin(), report.lost.end(), sentence) == report.lost.end()) {
        report.lost.push_back(sentence);
      }
    }
    report.folders.push_back(folder);
  }
  return report;
}

}  // namespace atelier
