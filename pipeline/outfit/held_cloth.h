#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/garment.h"
#include "registration/tracking/holding_file.h"
#include "registration/tracking/registered_outfit.h"
#include "simulation/contact/held_positions.h"

namespace atelier {

/// Help of the option of every stage that simulates what was captured.
inline constexpr const char* kHoldingHelp =
    "Rings by which the body holds the garments: a file like holding.toml of register, or none; "
    "empty: as register found them";

/// Refuses an option `--holding` that names no file. Throws UnknownValue.
void require_holding_named(const std::string& option);

/// What holds garments by an option `--holding`: the file that it names, or where it is empty
/// `found` (the file of register); for "none" nothing does, and the rings of `found` are only
/// watched. Throws DataError for a file that is none or
/// that is about other garments.
std::vector<HeldRing> chosen_holding(const std::string& option, const std::filesystem::path& found,
                                     const std::vector<HeldGarment>& garments);

/// Gives each garment of an outfit its rings. `registered` is the result of `register`. Throws as
/// chosen_holding.
void hold_outfit(std::vector<RegisteredGarmentSequence>& outfit, const std::string& option,
                 const std::filesystem::path& registered);

/// Attaches the vertices of all bands to the body where the garment starts, [V,3] m. Vertices that
/// are attached already stay as they are. Throws as attach_to_body.
void attach_bands(const std::vector<HeldRing>& rings, const Points& start, const Points& body,
                  const Triangles& body_faces, Garment& garment);

/// Adds what the body holds of a garment, whose vertices attach_bands has attached, to that of the
/// cloth of several: its attachments and bands.
/// @param first  of the garment's vertices in the cloth
void add_held(const std::vector<HeldRing>& rings, const Garment& garment, Index first,
              HeldCloth& held);

/// Where the body holds the cloth, for Control::pin_targets; no rows where there are no bands, as
/// the cloth's own attachments do then.
Points pin_targets(const HeldCloth& held, const Points& body, const Triangles& body_faces);

/// A ring, and its vertices where the body carries them from where they started.
struct RingPlace {
  HeldRing ring;
  std::vector<Attachment> places;  ///< vertices of the whole cloth
};

/// @param first  of the garment's vertices in the cloth
std::vector<RingPlace> ring_places(const std::vector<HeldRing>& rings, Index first,
                                   const Points& start, const Points& body,
                                   const Triangles& body_faces);

/// How far a ring is from there, the mean over its vertices, m.
double ring_distance(const RingPlace& place, const Points& cloth, const Points& body,
                     const Triangles& body_faces);

/// Where a ring is farthest from its place in a run.
struct RingLeft {
  double distance = 0;  ///< m
  int frame = 0;

  void add(double metres, int in_frame) {
    if (metres > distance) {
      distance = metres;
      frame = in_frame;
    }
  }
};

/// Warnings of garments that left their place: bands by more than 5 cm, what rests on the body by
/// more than 10 cm (our choice; skin slides under a neckline when arms are raised).
std::vector<std::string> left_places(const std::vector<RingPlace>& places,
                                     const std::vector<RingLeft>& left);

}  // namespace atelier
