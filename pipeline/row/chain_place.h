#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace atelier {

struct CaptureFacts;  // capture/layouts/capture_facts.h

/// Where a run reads and writes.
struct RunPlaces {
  std::filesystem::path capture;
  std::filesystem::path workspace;
};

/// How long a stage takes: on the two processor cores on which it was measured
/// (docs/results/demo_ranges.md has the times that these follow from).
struct StageCost {
  double seconds = 0;      ///< once
  double per_picture = 0;  ///< s, of a megapixel of each camera in each frame that is read
  double per_frame = 0;    ///< s, of each frame
  double per_clothed = 0;  ///< s, of each clothed frame with masks
  bool parallel = false;   ///< goes with the number of cores
  bool unmasked = false;   ///< reads every frame with an image, not only those with masks
};

/// How much memory a stage needs at most, of the largest process, in 10^6 bytes.
struct StageMemory {
  double megabytes = 600;
  double per_picture = 0;  ///< of a megapixel of each camera, for each frame worked on at once
};

/// An option of a stage that a run sets where nobody did.
struct SuggestedOption {
  std::string_view name;
  std::string_view value;
  std::string_view why;  ///< what the manifest names as its source: "no garment was captured"
};

/// The place of a stage in the chain from images to avatar, beyond its order: a stage runs behind
/// those before it in the table of stages.
struct ChainPlace {
  /// Why the capture has nothing for it, one sentence; "" if it has. Null: every capture has.
  std::string (*lacks)(const CaptureFacts& facts) = nullptr;
  /// Stages whose results its INPUT is made of, beside those that make the kinds it reads.
  std::vector<std::string_view> (*made_of)(const CaptureFacts& facts) = nullptr;
  /// Its INPUT, written into the workspace where it is made of results; null: the capture.
  std::filesystem::path (*input)(const RunPlaces& places) = nullptr;
  /// Whether its frames can be divided among runs beside each other (--shard) that share the work:
  /// no frame waits for another's, or those that are done are found by all.
  bool splits = false;
  StageCost cost{};
  StageMemory memory{};
  StageCost report_cost{};  ///< of its part of the report: digests of its files, pictures
  StageCost truth_cost{};   ///< of its figures there, of a synthetic capture
  /// The option that `run --material` sets: one fabric for all garments; "": it has none.
  std::string_view fabric = "";
  /// A kind that it reads, if there is a result of it, and that says the fabric: the option is set
  /// only where a run makes none of it. "": the option is always set.
  std::string_view fabric_from = "";
  /// Options that a run sets where nobody did. Null: none.
  std::vector<SuggestedOption> (*suggested)(const CaptureFacts& facts) = nullptr;
  /// Writes what other programs read of its result into a folder of the workspace, at the end of a
  /// run; returns the folder. Null: nothing.
  std::filesystem::path (*exported)(const std::filesystem::path& workspace) = nullptr;
};

}  // namespace atelier
