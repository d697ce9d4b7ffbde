#include <string_view>

#include "fuzz/reader.h"
#include "pipeline/sealing/sealing_note.h"

ATELIER_FUZZ_READER(sealing_note) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const atelier::SealingNote note = atelier::parse_sealing_note(text, ".sealed.toml");
  ATELIER_CHECK(note.kind == "workspace" || note.kind == "export", "a note of nothing");
}
