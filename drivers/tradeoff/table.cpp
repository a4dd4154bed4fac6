#include <fmt/format.h>

#include "study.h"

namespace repose::tradeoff {

std::string label(const Variant& variant) {
  if (variant.study == "load steps")
    return variant.load_steps > 0 ? fmt::format("{}", variant.load_steps) : "automatic";
  if (variant.study == "volume") return std::string(word(variant.volume));
  if (variant.study == "layers" || variant.study == "springs")
    return fmt::format("{}", variant.layers);
  if (variant.study == "mesh")
    return variant.edge > 0 ? fmt::format("{:g} mm", variant.edge) : "as it is";
  return fmt::format("{}, {:g} mm", variant.method, variant.accuracy);
}

std::string table(const std::vector<Measurement>& measurements) {
  std::string text =
      "study,method,accuracy_mm,volume,load_steps,layers,edge_mm,points,unknowns,converged,"
      "cpu_s,evaluations,hessians,iterations,estimate_mm,error_mm,skin_rms_mm,skin_95_mm,"
      "skin_max_mm,reason\n";
  for (const Measurement& m : measurements) {
    const Variant& w = m.variant;
    text += fmt::format("{},{},{:g},{},{},{},{:g},{},{},{},", w.study, w.method, w.accuracy,
                        word(w.volume), w.load_steps > 0 ? std::to_string(w.load_steps) : "auto",
                        w.layers, w.edge, m.points, m.unknowns, m.converged ? 1 : 0);
    text += fmt::format("{:.4g},{},{},{},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},\"{}\"\n", m.seconds,
                        m.evaluations, m.assemblies, m.iterations, m.estimate, m.error, m.skin_rms,
                        m.skin_95, m.skin_max, m.reason);
  }
  return text;
}

std::string map_table(const Map& map) {
  std::string text = "x,y,z";
  for (const Variant& variant : map.variants)
    text += fmt::format(",\"{}: {}\"", variant.study, label(variant));
  text += "\n";
  for (size_t v = 0; v < map.rest.size(); ++v) {
    text += fmt::format("{:.4f},{:.4f},{:.4f}", map.rest[v].x(), map.rest[v].y(), map.rest[v].z());
    for (const auto& error : map.error) text += fmt::format(",{:.4g}", error[v]);
    text += "\n";
  }
  return text;
}

}  // namespace repose::tradeoff
