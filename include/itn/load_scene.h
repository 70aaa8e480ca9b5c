// Reads a Mitsuba 3 XML scene into the host model.
#pragma once
#include <map>
#include <optional>
#include <string>

#include "itn/scene.h"

namespace itn {

constexpr int largest_film = 32768;  // [pixel] along each axis

// Limit of coordinates and sizes [scene units]: products of three are computed in single precision.
constexpr double largest_extent = 1e12;

struct FilmSize {
  int width = 0, height = 0;  // [pixel]
};

struct LoadOptions {
  std::optional<FilmSize> size{};  // of every film, instead of the scene's; a crop keeps its fraction
  bool open = false;               // a shape that bounds a medium and is not closed is a warning, not an error
};

// definitions fill $name in the file and win over its <default> elements. Throws InputError for anything wrong in the
// scene or in a file it names: every problem on a line of its own ("file:line:column: ..."); UsageError for a
// definition that the scene never uses. What is merely suspicious goes to Scene::warnings.
Scene load_scene(const std::string& file, const std::map<std::string, std::string>& definitions = {},
                 const LoadOptions& options = {});

// As if `file` had this text.
Scene load_scene_text(const std::string& file, const std::string& text, const LoadOptions& options = {});

}  // namespace itn
