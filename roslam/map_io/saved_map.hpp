// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/map/map.hpp"
#include "roslam/place_recognition/vocabulary.hpp"

namespace roslam {

class KeyframeDatabase;
class MapMutex;

/// A map as stored between sessions, with what another session needs to continue it.
struct ROSLAM_EXPORT SavedMap {
  std::string name = "map";  ///< of its file, for messages
  Camera camera;             ///< that made it
  Map map{{}};
  std::uint64_t vocabulary = 0;   ///< fingerprint of the vocabulary of the words, 0: there are no words
  std::vector<BagOfWords> words;  ///< by keyframe id, may be fewer

  /// A copy of all existing elements of a map that nobody else uses, with ids without gaps. database: source
  /// of the words, may be null.
  static SavedMap of(const Camera& camera, const Map& map, const KeyframeDatabase* database);

  /// Of a map and a database that others change, as MapParts. without: submaps that are left out.
  static SavedMap of(const Camera& camera, const Map& map, const KeyframeDatabase* database, MapMutex& mutex,
                     const std::set<SubmapId>& without);

  /// Throws InputError if the map was made with another camera or with other pyramid levels, so that its
  /// frames cannot be matched with it.
  void require_fits(const Camera& camera, std::span<const float> scales) const;

  /// Adds the keyframes to a database; their words are recomputed if they are of another vocabulary.
  void index(KeyframeDatabase& database) const;
};

}  // namespace roslam
