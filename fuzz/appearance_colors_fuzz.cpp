#include "appearance/appearance_colors.h"
#include "fuzz/forged_archive.h"
#include "fuzz/reader.h"

/// Colours of five pixels; what is read can be written and reads the same.
ATELIER_FUZZ_READER(appearance_colors) {
  const atelier::AppearanceColors colors = atelier::appearance_colors_of(
      atelier::parse_archive(atelier::fuzz::with_right_digest(bytes), "atelier.appearance_colors",
                             1, "colors"),
      5, "colors");
  ATELIER_CHECK(colors.drawn.size() == 15 && colors.fixed.size() == 15, "both of every pixel");
  const atelier::AppearanceColors again =
      atelier::appearance_colors_of(atelier::archive_of(colors), 5, "written");
  ATELIER_CHECK(again.drawn == colors.drawn && again.fixed == colors.fixed,
                "colours read back as they were");
}
