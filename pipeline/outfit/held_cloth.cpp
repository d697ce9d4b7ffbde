#include "pipeline/outfit/held_cloth.h"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <set>

#include "core/error.h"
#include "core/unknown_value.h"
#include "registration/attach_to_body.h"

namespace atelier {

void require_holding_named(const std::string& option) {
  if (!option.empty() && option != "none" && !std::filesystem::exists(option)) {
    throw UnknownValue("", "holding", option, "none, or a file as holding.toml of register");
  }
}

std::vector<HeldRing> chosen_holding(const std::string& option, const std::filesystem::path& found,
                                     const std::vector<HeldGarment>& garments) {
  const bool none = option == "none";
  if (none && !std::filesystem::exists(found)) {
    return {};
  }
  const std::filesystem::path file = option.empty() || none ? found : std::filesystem::path(option);
  std::vector<HeldRing> rings = read_holding(file);
  require_holding(rings, garments, file.string());
  for (HeldRing& ring : rings) {
    ring.kind = none ? HoldingKind::Rest : ring.kind;
  }
  return rings;
}

void hold_outfit(std::vector<RegisteredGarmentSequence>& outfit, const std::string& option,
                 const std::filesystem::path& registered) {
  const std::filesystem::path found = registered / kHoldingFile;
  if (option.empty() && !std::filesystem::exists(found)) {
    throw DataError(found.string(), "", "no such file: the result is of an older version",
                    "what holds the garments; run 'atelier register' again, or say --holding none");
  }
  std::vector<HeldGarment> garments;
  for (const RegisteredGarmentSequence& one : outfit) {
    garments.push_back({one.name, one.garment.mesh.vertices.rows()});
  }
  const std::vector<HeldRing> rings = chosen_holding(option, found, garments);
  for (RegisteredGarmentSequence& one : outfit) {
    one.holding = rings_of(rings, one.name);
  }
}

namespace {

std::vector<Attachment> attached(const std::vector<int>& vertices, const Points& start,
                                 const Points& body, const Triangles& body_faces) {
  Points at(static_cast<Index>(vertices.size()), 3);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    at.row(static_cast<Index>(i)) = start.row(vertices[i]);
  }
  std::vector<Attachment> places = attach_to_body(at, body, body_faces);
  for (Attachment& place : places) {
    place.vertex = vertices[static_cast<std::size_t>(place.vertex)];
  }
  return places;
}

}  // namespace

void attach_bands(const std::vector<HeldRing>& rings, const Points& start, const Points& body,
                  const Triangles& body_faces, Garment& garment) {
  std::set<int> held;
  for (const Attachment& one : garment.attachments) {
    held.insert(one.vertex);
  }
  std::vector<int> vertices;
  for (const HeldRing& ring : rings) {
    if (ring.kind == HoldingKind::Band) {
      std::copy_if(ring.vertices.begin(), ring.vertices.end(), std::back_inserter(vertices),
                   [&](int v) { return held.insert(v).second; });
    }
  }
  if (vertices.empty()) {
    return;
  }
  for (const Attachment& one : attached(vertices, start, body, body_faces)) {
    garment.attachments.push_back(one);
  }
}

void add_held(const std::vector<HeldRing>& rings, const Garment& garment, Index first,
              HeldCloth& held) {
  const auto before = static_cast<int>(first);
  for (Attachment one : garment.attachments) {
    one.vertex += before;
    held.attachments.push_back(one);
  }
  for (const HeldRing& ring : rings) {
    if (ring.kind == HoldingKind::Band) {
      ClothBand band = make_band(garment.mesh.vertices, ring.vertices, ring.closed, ring.rest_girth,
                                 ring.stiffness);
      for (int& v : band.vertices) {
        v += before;
      }
      held.bands.push_back(std::move(band));
    }
  }
  held.vertices = std::max(held.vertices, first + garment.mesh.vertices.rows());
  held.thickness = garment.material.thickness;
}

Points pin_targets(const HeldCloth& held, const Points& body, const Triangles& body_faces) {
  return held.bands.empty() ? Points(0, 3) : held_positions(held, body, body_faces);
}

std::vector<RingPlace> ring_places(const std::vector<HeldRing>& rings, Index first,
                                   const Points& start, const Points& body,
                                   const Triangles& body_faces) {
  std::vector<RingPlace> places;
  for (const HeldRing& ring : rings) {
    RingPlace place{ring, attached(ring.vertices, start, body, body_faces)};
    for (Attachment& one : place.places) {
      one.vertex += static_cast<int>(first);
    }
    places.push_back(std::move(place));
  }
  return places;
}

double ring_distance(const RingPlace& place, const Points& cloth, const Points& body,
                     const Triangles& body_faces) {
  const Points there = body_driven(place.places, body, body_faces);
  double sum = 0;
  for (std::size_t i = 0; i < place.places.size(); ++i) {
    sum += (cloth.row(place.places[i].vertex) - there.row(static_cast<Index>(i))).norm();
  }
  return sum / static_cast<double>(std::max<std::size_t>(1, place.places.size()));
}

std::vector<std::string> left_places(const std::vector<RingPlace>& places,
                                     const std::vector<RingLeft>& left) {
  constexpr double kBand = 0.05;  // m
  constexpr double kRest = 0.10;  // m
  std::vector<std::string> said;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const HeldRing& ring = places[i].ring;
    if (left[i].distance > (ring.kind == HoldingKind::Band ? kBand : kRest)) {
      char text[200];
      std::snprintf(text, sizeof text,
                    ": %.0f mm from where the body carries it (mean, frame %d): the garment has "
                    "left its place; hold it by a band (--holding)",
                    1e3 * left[i].distance, left[i].frame);
      said.push_back(ring.garment + " " + ring.opening + text);
    }
  }
  return said;
}

}  // namespace atelier
