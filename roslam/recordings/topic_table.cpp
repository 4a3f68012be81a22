// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/recordings/topic_table.hpp"

#include <utility>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr std::size_t kMaxTopics = 65536;
constexpr std::size_t kMaxNameBytes = std::size_t{64} << 20;
constexpr std::size_t kMaxDefinitionBytes = std::size_t{64} << 20;
}  // namespace

int TopicTable::add(RecordedTopic topic) {
  const auto [entry, is_new] =
      ids_.try_emplace({topic.name, topic.type, topic.encoding}, static_cast<int>(topics_.size()));
  if (!is_new) {
    if (topic.messages) count(entry->second, *topic.messages);
    return entry->second;
  }
  name_bytes_ += topic.name.size() + topic.type.size() + topic.encoding.size();
  if (topics_.size() >= kMaxTopics || name_bytes_ > kMaxNameBytes)
    throw InputError(name_ + ": damaged, it describes more than 65536 topics; record it again");
  if (topic.definition.size() > kMaxDefinitionBytes - definition_bytes_) topic.definition.clear();
  definition_bytes_ += topic.definition.size();
  topic.id = entry->second;
  topics_.push_back(std::move(topic));
  return entry->second;
}

void TopicTable::assign(std::uint32_t channel, int topic) {
  of_channel_[channel] = topic;
  if (of_channel_.size() > kMaxTopics)
    throw InputError(name_ + ": damaged, it describes more than 65536 channels; record it again");
}

std::optional<int> TopicTable::of(std::uint32_t channel) const {
  const auto found = of_channel_.find(channel);
  return found == of_channel_.end() ? std::nullopt : std::optional(found->second);
}

void TopicTable::count(int topic, std::size_t messages) {
  auto& count = topics_[static_cast<std::size_t>(topic)].messages;
  count = count.value_or(0) + messages;
}

}  // namespace roslam
