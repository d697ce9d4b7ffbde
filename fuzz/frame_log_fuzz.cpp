#include <cmath>
#include <string_view>

#include "core/store/frame_log.h"
#include "fuzz/reader.h"

/// A log refuses nothing: lines that are no records are left out, and their frames done again. So
/// that a spoiled line can be told from a sound one, a text without any record is refused here.
ATELIER_FUZZ_READER(frame_log) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::map<int, atelier::FrameRecord> records;
  atelier::add_frame_records(text, records);
  for (const auto& [frame_id, record] : records) {
    ATELIER_CHECK(frame_id >= 0 && record.frame_id == frame_id, "a record of another frame");
    ATELIER_CHECK(atelier::is_safe_output_path(record.output.path), "an unsafe path was read");
    for (const atelier::ManifestOutput& output : record.beside) {
      ATELIER_CHECK(atelier::is_safe_output_path(output.path) && output.size >= 0,
                    "an unsafe further file was read");
    }
    ATELIER_CHECK(record.output.size >= 0 && record.peak_memory_bytes >= 0, "a negative count");
    ATELIER_CHECK(std::isfinite(record.seconds) && record.seconds >= 0, "no duration");
  }
  if (records.empty()) {
    throw atelier::DataError("frames.jsonl", "", "no record", "lines of finished frames");
  }
}
