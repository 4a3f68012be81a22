// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/pipeline/options.hpp"

namespace roslam {

/// Names every option once, for reading and writing alike: visit(section, key, field) is called for each.
template <typename OptionsType, typename Visitor>
void for_each_option(OptionsType& o, Visitor&& visit) {
  visit("orb", "features", o.orb.features);
  visit("orb", "levels", o.orb.levels);
  visit("orb", "scale_factor", o.orb.scale_factor);
  visit("orb", "fast_threshold", o.orb.fast_threshold);
  visit("orb", "min_fast_threshold", o.orb.min_fast_threshold);
  visit("orb", "cell_size", o.orb.cell_size);
  visit("orb", "mask_margin", o.orb.mask_margin);
  visit("depth", "min_depth", o.depth.min_depth);
  visit("depth", "max_depth", o.depth.max_depth);
  visit("depth", "edge_ratio", o.depth.edge_ratio);
  visit("noise", "pixel_sigma", o.noise.pixel_sigma);
  visit("noise", "depth_sigma", o.noise.depth_sigma);
  visit("noise", "depth_sigma_growth", o.noise.depth_sigma_growth);
  visit("noise", "outlier_factor", o.noise.outlier_factor);
  visit("segmenter", "working_side", o.segmenter.working_side);
  visit("removal", "labels", o.removal.labels);
  visit("removal", "free_space", o.removal.free_space);
  visit("removal", "flow", o.removal.flow);
  visit("removal", "carry", o.removal.carry);
  visit("removal", "refine", o.removal.refine);
  visit("removal", "label_every", o.removal.label_every);
  visit("removal", "max_labelled_share", o.removal.max_labelled_share);
  visit("removal", "min_object_share", o.removal.min_object_share);
  visit("removal", "sure", o.removal.sure);
  visit("removal", "keep_resting", o.removal.keep_resting);
  visit("removal", "keep_missed", o.removal.keep_missed);
  visit("removal", "history", o.removal.history);
  visit("removal", "history_interval", o.removal.history_interval);
  visit("removal", "depth_tolerance", o.removal.depth_tolerance);
  visit("removal", "flow_interval", o.removal.flow_interval);
  visit("removal", "flow_tolerance", o.removal.flow_tolerance);
  visit("removal", "rest", o.removal.rest);
  visit("removal", "growth", o.removal.growth);
  visit("removal", "edge_band", o.removal.edge_band);
  visit("removal", "margin", o.removal.margin);
  visit("removal", "scarce_points", o.removal.scarce_points);
  visit("matcher", "max_distance", o.matcher.max_distance);
  visit("matcher", "strict_distance", o.matcher.strict_distance);
  visit("matcher", "ratio", o.matcher.ratio);
  visit("matcher", "frame_radius", o.matcher.frame_radius);
  visit("matcher", "map_radius", o.matcher.map_radius);
  visit("matcher", "fuse_radius", o.matcher.fuse_radius);
  visit("matcher", "depth_tolerance", o.matcher.depth_tolerance);
  visit("pose", "rounds", o.pose.rounds);
  visit("pose", "iterations", o.pose.iterations);
  visit("local_map", "max_keyframes", o.local_map.max_keyframes);
  visit("local_map", "neighbours", o.local_map.neighbours);
  visit("relocaliser", "min_matches", o.relocaliser.min_matches);
  visit("relocaliser", "min_inliers", o.relocaliser.min_inliers);
  visit("relocaliser", "candidates", o.relocaliser.candidates);
  visit("relocaliser", "iterations", o.relocaliser.iterations);
  visit("relocaliser", "max_error", o.relocaliser.max_error);
  visit("tracker", "min_initial_points", o.tracker.min_initial_points);
  visit("tracker", "min_inliers", o.tracker.min_inliers);
  visit("tracker", "min_frame_matches", o.tracker.min_frame_matches);
  visit("tracker", "min_agreement", o.tracker.min_agreement);
  visit("tracker", "trusted_inliers", o.tracker.trusted_inliers);
  visit("tracker", "scarce_inliers", o.tracker.scarce_inliers);
  visit("tracker", "hidden_share", o.tracker.hidden_share);
  visit("tracker", "max_predicted", o.tracker.max_predicted);
  visit("tracker", "recently_lost_frames", o.tracker.recently_lost_frames);
  visit("keyframes", "max_interval", o.keyframes.max_interval);
  visit("keyframes", "min_interval", o.keyframes.min_interval);
  visit("keyframes", "min_overlap", o.keyframes.min_overlap);
  visit("keyframes", "min_tracked_near", o.keyframes.min_tracked_near);
  visit("keyframes", "min_new_near", o.keyframes.min_new_near);
  visit("keyframes", "near", o.keyframes.near);
  visit("landmarks", "max_relative_depth_sigma", o.landmarks.max_relative_depth_sigma);
  visit("landmarks", "neighbours", o.landmarks.neighbours);
  visit("landmarks", "min_parallax", o.landmarks.min_parallax);
  visit("landmarks", "min_shared", o.landmarks.min_shared);
  visit("fusion", "neighbours", o.fusion.neighbours);
  visit("fusion", "second_neighbours", o.fusion.second_neighbours);
  visit("culling", "min_found_ratio", o.culling.min_found_ratio);
  visit("culling", "probation", o.culling.probation);
  visit("culling", "min_observations", o.culling.min_observations);
  visit("culling", "redundant_share", o.culling.redundant_share);
  visit("culling", "redundant_views", o.culling.redundant_views);
  visit("culling", "keep_newest", o.culling.keep_newest);
  visit("bundle", "iterations", o.bundle.iterations);
  visit("bundle", "window", o.bundle.window);
  visit("bundle", "min_shared", o.bundle.min_shared);
  visit("threads", "frame_queue", o.threads.frame_queue);
  visit("threads", "keyframe_queue", o.threads.keyframe_queue);
  visit("threads", "segmentation_timeout", o.threads.segmentation_timeout);
}

}  // namespace roslam
