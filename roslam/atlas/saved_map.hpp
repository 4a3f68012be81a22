// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/map/map.hpp"
#include "roslam/places/place_index.hpp"

namespace roslam {

/// A map cut loose from the flight that made it, with what another flight needs to go on from it.
struct SavedMap {
  std::string name = "map";  ///< of its file, for messages
  Camera camera;             ///< that made it
  Map map{{}};
  std::uint64_t vocabulary = 0;   ///< fingerprint of the vocabulary the words are of, 0: there are no words
  std::vector<BagOfWords> words;  ///< by keyframe id, may be fewer

  /// A copy of what lives, with ids without gaps. places: null, or where the words of the keyframes are.
  static SavedMap of(const Camera& camera, const Map& map, const PlaceIndex* places);

  /// Throws InputError if frames of that camera could not be found in the map: it was made with another
  /// camera, or with other pyramid levels.
  void require_fits(const Camera& camera, std::span<const float> scales) const;

  /// Puts the keyframes into an index; their words are made anew if they are of another vocabulary.
  void index(PlaceIndex& places) const;
};

}  // namespace roslam
