/* The tables of expected futures (derivative/baseline.h), and what paths tell to learn them: the same for host and device. */
#ifndef ITN_BASELINE_LAYOUT_H
#define ITN_BASELINE_LAYOUT_H

/* Cells of a medium: [kind of decision][depth][cosine]. */
enum { DECISION_FLIGHT, DECISION_SCATTER, DECISIONS };
#define BASELINE_DEPTHS 24
#define BASELINE_COSINES 24
#define BASELINE_MEDIUM_CELLS (DECISIONS * BASELINE_DEPTHS * BASELINE_COSINES)

/* Cells of a rough boundary: cosines of arrival, -1 to 1. */
#define BASELINE_BOUNDARY_CELLS 48

/* A path of the pilot tells the states of its first events, DECISIONS of each: for each of them a cell + 1 (an int, 0:
 * none), then for each throughput channel its weight and for each radiance channel what it had gathered before. */
#define BASELINE_EVENTS 64
#define BASELINE_VISITS (BASELINE_EVENTS * DECISIONS)
#define BASELINE_VISIT_SIZE(throughput_channels, radiance_channels) (1 + (throughput_channels) + (radiance_channels))

#endif
