; The smallest of four disks lies beside the pegs and must be recovered first.
(define (problem four-disks-one-off)
  (:domain hanoi)
  (:objects
    red_disk orange_disk yellow_disk green_disk - disk
    left_peg middle_peg right_peg - peg)
  (:init
    (on-peg red_disk left_peg) (on-peg orange_disk left_peg)
    (on orange_disk red_disk) (clear orange_disk)
    (on-peg yellow_disk middle_peg)
    (clear yellow_disk)
    (off-peg green_disk) (clear green_disk)
    (smaller orange_disk red_disk) (smaller yellow_disk red_disk) (smaller green_disk red_disk)
    (smaller yellow_disk orange_disk) (smaller green_disk orange_disk)
    (smaller green_disk yellow_disk))
  (:goal (forall (?d - disk) (on-peg ?d right_peg))))
