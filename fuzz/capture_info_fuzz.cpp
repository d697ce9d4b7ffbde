#include <string>

#include "capture/capture_info.h"
#include "core/utf8.h"
#include "fuzz/reader.h"

/// What is read can be written, and then says the same.
ATELIER_FUZZ_READER(capture_info) {
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const atelier::CaptureInfo info = atelier::parse_capture_toml(text, "capture.toml");
  const std::string written = atelier::capture_toml(info);
  const atelier::CaptureInfo again = atelier::parse_capture_toml(written, "written");
  ATELIER_CHECK(again.subject == info.subject && again.consent == info.consent &&
                    again.held_out_frames == info.held_out_frames,
                "a capture.toml reads back as it was");
  ATELIER_CHECK(atelier::capture_toml(again) == written, "a capture.toml is written alike twice");
  for (const atelier::CaptureSequence& sequence : info.sequences) {
    ATELIER_CHECK(atelier::is_plain_name(sequence.name), "a name that is unsafe in a path");
  }
  ATELIER_CHECK(atelier::is_printable_utf8(info.subject), "a subject that cannot be shown");
}
