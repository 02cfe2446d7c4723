/* signorini for C, and for what calls C: commands as at the terminal, answers as JSON, datasets of files as arrays.
 *
 *   make c        builds target/release/libsignorini_c.{so,dylib,a}, and runs the example
 *   cc plate.c -I src/c -L target/release -lsignorini_c
 *
 * Texts are UTF-8 and end with a zero byte. Several calls may be made at the same time, from several threads. */
#ifndef SIGNORINI_H
#define SIGNORINI_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SIGNORINI_RANK 8

/* What a command answered. */
typedef struct signorini_answer signorini_answer;

/* Numbers of a dataset, row by row: data[i * shape[1] + j]. */
typedef struct {
    size_t rank;
    size_t shape[SIGNORINI_RANK];
    size_t size;
    double *data;
} signorini_array;

/* The version of the program. */
const char *signorini_version(void);

/* Carry a command out, its arguments as at the terminal without the program's name: {"run", "plate.toml", "-o", "plate.h5"}.
 * Nothing is printed (--help and --version are for the terminal). The answer is never null. */
signorini_answer *signorini_call(const char *const *arguments, size_t count);

/* 0: done; 2: bad input; 3: the numerics failed (the answer says how far they came); 1: anything else. */
int signorini_code(const signorini_answer *answer);

/* The object that --json prints, the reason of a failure, and warnings a line each: empty where there are none. They live as long as the answer. */
const char *signorini_json(const signorini_answer *answer);
const char *signorini_message(const signorini_answer *answer);
const char *signorini_warnings(const signorini_answer *answer);
void signorini_free(signorini_answer *answer);

/* A dataset of a file of results ("trajectory/u", "switches/t": docs/reference/datasets.md) as numbers. 0: done; 1: *message says why not,
 * where message is not null. */
int signorini_read(const char *file, const char *name, signorini_array *array, char **message);
void signorini_free_array(signorini_array *array);
void signorini_free_text(char *message);

#ifdef __cplusplus
}
#endif
#endif
