/* A motion, and the largest displacement at each contact node: motion SCENE.toml FILE.h5 */
#include <math.h>
#include <stdio.h>

#include "signorini.h"

/* A dataset, or the end. */
static int dataset(const char *file, const char *name, signorini_array *array)
{
    char *why = NULL;
    if (signorini_read(file, name, array, &why) == 0)
        return 0;
    fprintf(stderr, "%s\n", why);
    signorini_free_text(why);
    return 1;
}

int main(int count, char **words)
{
    if (count != 3) {
        fprintf(stderr, "usage: motion SCENE.toml FILE.h5\n");
        return 2;
    }
    const char *arguments[] = {"run", words[1], "--force", "-o", words[2]};
    signorini_answer *answer = signorini_call(arguments, sizeof arguments / sizeof *arguments);
    int code = signorini_code(answer);
    fprintf(stderr, "%s%s", signorini_warnings(answer), signorini_message(answer));
    signorini_free(answer);
    if (code != 0)
        return code;

    signorini_array t, pressure, switches;
    if (dataset(words[2], "trajectory/t", &t) || dataset(words[2], "trajectory/pressure", &pressure) || dataset(words[2], "switches/t", &switches))
        return 1;
    double largest = 0.0;
    for (size_t i = 0; i < pressure.size; i++)
        largest = fmax(largest, pressure.data[i]);
    printf("%zu states until %.17g, %zu switches, the first at %.17g, largest pressure %.17g at %zu points\n", t.size, t.data[t.size - 1],
           switches.size, switches.size > 0 ? switches.data[0] : NAN, largest, pressure.shape[1]);
    signorini_free_array(&t);
    signorini_free_array(&pressure);
    signorini_free_array(&switches);
    return 0;
}
