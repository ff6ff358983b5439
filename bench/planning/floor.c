/* The floor of a check: MuJoCo's own kinematics and collision detection at many postures, in a loop in C. */
#include <stdint.h>
#include <string.h>

void postures(const void *model, void *data, void (*kinematics)(const void *, void *), void (*collision)(const void *, void *),
              double *positions, int64_t count, const double *q) {
    for (int64_t n = 0; n < count; n++) {
        memcpy(positions, q + 7 * n, 7 * sizeof *q);
        kinematics(model, data);
        collision(model, data);
    }
}
