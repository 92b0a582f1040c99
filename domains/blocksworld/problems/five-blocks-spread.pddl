; Every block on the table, whatever stands where.
(define (problem five-blocks-spread)
  (:domain blocksworld)
  (:requirements :universal-preconditions)
  (:objects
    blue_block green_block purple_block red_block yellow_block - block
    arm - robot)
  (:init
    (handempty arm)
    (ontable red_block) (on blue_block red_block) (on yellow_block blue_block) (clear yellow_block)
    (ontable green_block) (on purple_block green_block) (clear purple_block))
  (:goal (forall (?x - block) (ontable ?x))))
