#include "core/store/output_sequences.h"

#include <filesystem>
#include <span>

#include "core/error.h"

namespace atelier {

bool output_sequences(StageRun& run, const std::vector<OutputSequence>& sequences,
                      const std::vector<int>& frame_ids,
                      const std::function<std::vector<Archive>(int frame_id)>& make) {
  std::vector<FrameFiles> files;
  for (const OutputSequence& sequence : sequences) {
    ATELIER_CHECK(!sequence.header || sequence.header->frame_ids == frame_ids,
                  sequence.frames + " is of other frames");
    files.push_back({sequence.frames, ".h5"});
  }
  const bool complete = run.each_frame(
      files, frame_ids,
      [&](int frame_id, std::span<const std::filesystem::path> paths) {
        const std::vector<Archive> archives = make(frame_id);
        ATELIER_CHECK(archives.size() == paths.size(), "one archive of a frame for each sequence");
        for (std::size_t i = 0; i < archives.size(); ++i) {
          write_archive(paths[i], archives[i]);
        }
      },
      0);
  if (!complete) {
    return false;
  }
  for (const OutputSequence& sequence : sequences) {
    if (sequence.header) {
      const std::filesystem::path folder = std::filesystem::path(sequence.frames).parent_path();
      run.output((folder / "sequence.h5").generic_string(), [&](const std::filesystem::path& file) {
        write_archive(file, archive_of(*sequence.header));
      });
    }
  }
  return true;
}

}  // namespace atelier
